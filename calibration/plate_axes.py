"""Which way a plate's horizontal moments are turned or mirrored, told before its clock is.

    y_k(t) ~ Q x_k(t - lag_k),   Q'Q = 1        min over Q, lag_k by |y - mean y| against |x - mean x|, free of Q

y moments of the moving masses in lab axes, x those of the plate, of all trials k. A sign or a turn that nobody knows
of would otherwise pass as a clock that is off by half a period of the motion, and the plate as one that saw another.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calibration.lag import Pair, coarse_lag
from calibration.signals import Signal

_SMALL = np.radians(20.0)  # a smaller turn does not hide the clock, and is left to those who judge the plate [rad]


def plate_axes(pairs: Sequence[Pair]) -> np.ndarray:
    """Q (2, 2), exactly the identity unless the plate is mirrored or turned by more than 20 deg."""
    C = np.zeros((2, 2))
    for pair in pairs:
        y, x = _centred(pair.y), _centred(pair.x)
        s = y.t - coarse_lag(_length(y), _length(x))
        at = np.stack([np.interp(s, x.t, column, left=0.0, right=0.0) for column in x.x.T], axis=1)
        C += y.x.T @ at
    U, _, Vt = np.linalg.svd(C)
    Q = U @ Vt
    is_usual = np.linalg.det(Q) > 0.0 and abs(np.arctan2(Q[1, 0], Q[0, 0])) < _SMALL
    return np.eye(2) if is_usual else np.asarray(Q)


def _centred(signal: Signal) -> Signal:
    return replace(signal, x=signal.x - signal.x.mean(axis=0))


def _length(signal: Signal) -> Signal:
    return replace(signal, x=np.linalg.norm(signal.x, axis=1, keepdims=True))
