"""Numerics without a robot: SE(3), signals, alignment, robust covariance, delays, wrenches; how many cores they use."""

from calibration.numerics.side_by_side import on_cores

__all__ = ["on_cores"]
