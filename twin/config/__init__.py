"""A robot and its campaign as a scenario states them."""
