"""What was recorded, at a glance."""
