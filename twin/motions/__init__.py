"""What a campaign commands: set-points of joints and base, and the order of the trials."""

from twin.motions.csv_trajectory import trajectory
from twin.motions.motion import RATE, BasePath, Motion, static_postures, swing
from twin.motions.postures import sample_postures
from twin.motions.swings import CALIBRATION_SWINGS, JOINTS, VALIDATION_SWINGS, Swing
from twin.motions.trial_schedule import schedule

__all__ = [
    "CALIBRATION_SWINGS",
    "JOINTS",
    "RATE",
    "VALIDATION_SWINGS",
    "BasePath",
    "Motion",
    "Swing",
    "sample_postures",
    "schedule",
    "static_postures",
    "swing",
    "trajectory",
]
