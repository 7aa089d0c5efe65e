"""Frozen tasks: robots with known errors, blind datasets, and one score for everybody's calibrations."""
