"""What a laboratory and a robot measure; one file an instrument."""
