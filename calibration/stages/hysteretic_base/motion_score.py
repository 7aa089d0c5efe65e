"""How well a base's motion is predicted where it was not fitted.

hand   rms |t + theta x p| of the error, p where a hand would be          [m]
R2     1 - sum (psi - psi_p)^2 / sum (psi - r)^2          r = 0: a base that stays; r = the mean of the part
"""

from dataclasses import dataclass

import numpy as np

from calibration.errors import NotEnoughData
from calibration.stages.hysteretic_base.fit import refitted
from calibration.stages.hysteretic_base.log import BaseLog
from calibration.stages.hysteretic_base.model import HystereticBase

HAND = np.array([0.8, 0.0, 1.0])  # [m, frame 0]
_TWO_SIDED = 1.96


@dataclass(frozen=True)
class MotionScore:
    """Of one stretch of a log.

    Attributes:
        seconds: How long.
        hand: rms error at the hand [m].
        still: The same of a base that stays.
        about_mean: rms error at the hand without its mean [m].
        yaw_r2: Against a base that stays [-].
        yaw_r2_about_mean: Against the mean of the stretch, its error's mean taken off [-].
        axes: (6,) rms errors [m, rad].
        covered: (6,) share of samples in the 95 % band.
    """

    seconds: float
    hand: float
    still: float
    about_mean: float
    yaw_r2: float
    yaw_r2_about_mean: float
    axes: np.ndarray
    covered: np.ndarray


def score(base: HystereticBase, log: BaseLog, rows: np.ndarray, x: np.ndarray | None = None) -> MotionScore:
    """The score on some samples (n,) of a log; of a prediction x (n, 6), the base's own unless given.

    Raises:
        NotEnoughData: There are no such samples.
    """
    if not rows.any():
        raise NotEnoughData("no sample of the log is left to predict")
    x = base.displacement(log.w) if x is None else x
    e, moved = (log.x - x)[rows], log.x[rows]
    at_hand, psi = hand_motion(e), moved[:, 5]
    error, swing = e[:, 5] - e[:, 5].mean(), psi - psi.mean()
    return MotionScore(
        float(rows.sum() * (log.t[1] - log.t[0])),
        _rms(at_hand),
        _rms(hand_motion(moved)),
        _rms(at_hand - at_hand.mean(axis=0)),
        float(1.0 - (e[:, 5] ** 2).sum() / (psi**2).sum()),
        float(1.0 - (error**2).sum() / (swing**2).sum()),
        np.sqrt((e**2).mean(axis=0)),
        (np.abs(e) <= _TWO_SIDED * np.sqrt(base.variance)).mean(axis=0),
    )


def left_out_cycles(base: HystereticBase, log: BaseLog, start: float, period: float) -> MotionScore:
    """The score of cycles from `start` on, `period` [s] long, each by a base fitted to all else of the log.

    Raises:
        NotEnoughData: There are not two cycles.
    """
    number = np.floor((log.t - start) / period + 1e-9)
    last = np.floor((log.t[-1] - start) / period + 0.5)
    if last < 2:
        raise NotEnoughData(f"fewer than two cycles of {period:g} s after {start:g} s")
    number = np.minimum(number, last - 1)  # half a cycle and more counts as one, less belongs to the one before
    x = np.zeros_like(log.x)
    for k in range(int(last)):
        out = number == k
        x[out] = refitted(base, log, ~out).displacement(log.w)[out]
    return score(base, log, number >= 0, x)


def hand_motion(x: np.ndarray) -> np.ndarray:
    """Motion of the hand (n, 3) with displacements (n, 6)."""
    return np.asarray(x[:, :3] + np.cross(x[:, 3:], HAND))


def _rms(e: np.ndarray) -> float:
    return float(np.sqrt((e**2).sum(axis=1).mean()))
