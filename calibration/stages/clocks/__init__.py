"""Stage clocks: the instruments' clocks on that of the motion capture."""
