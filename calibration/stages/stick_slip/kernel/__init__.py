"""A rigid base on wheels that stick, slip and lift off, integrated in compiled code.

integration    `simulated`: some bases in trials one after the other; `advance`: one sample on
bases          `Bases`: how they lie in memory; `at_rest`
wheel_forces   what wheels put on the floor that stick or slide
heaving        heave and tilt beside
preloaded      what a plate says of how wheels stood
informed       and of their parameters
corrector      what a force plate corrects of their positions
lifted         the load of wheels that are left on the floor
"""
