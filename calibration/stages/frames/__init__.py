"""Base frame from spins and drives; arm and tool frames from postures (Heins et al.)."""

from calibration.stages.frames.arm_tool_stage import locate_arm
from calibration.stages.frames.base_rests import Stations, read_stations
from calibration.stages.frames.base_stage import locate_base

__all__ = ["Stations", "locate_arm", "locate_base", "read_stations"]
