"""From states to what instruments record."""
