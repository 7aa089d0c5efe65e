"""What makes a robot differ from nominal."""
