"""Clocks of robot and force plate relative to the motion capture."""

from calibration.stages.clocks.stage import synchronise

__all__ = ["synchronise"]
