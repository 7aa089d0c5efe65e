"""Stage suspension: base motion under a wrench."""
