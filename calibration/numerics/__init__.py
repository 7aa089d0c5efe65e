"""Numerics without a robot: SE(3), signals, alignment, robust covariance, delays, wrenches."""
