"""The base under a plate's wrench alone: hysteresis by axis, where no joint is read or no wheel is declared."""

from calibration.stages.hysteretic_base.fit import fit_base
from calibration.stages.hysteretic_base.log import BaseLog, log_of
from calibration.stages.hysteretic_base.model import HystereticBase
from calibration.stages.hysteretic_base.motion_score import HAND, MotionScore, left_out_cycles, score

__all__ = [
    "HAND",
    "BaseLog",
    "HystereticBase",
    "MotionScore",
    "fit_base",
    "left_out_cycles",
    "log_of",
    "score",
]
