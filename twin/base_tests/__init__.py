"""Benches of the base: load test, gravity stiffness, slip load, replayed wrenches."""
