"""Signals made alike before they are compared in time: one grid rate, one zero-phase low-pass, derivatives by spline.

A filter used on one of two signals only would shift their lag; every function here is applied to both.

The play operator, as a basis for what friction-held gears do to a motion.

    p_k = clip(p_{k-1}, q_k - w, q_k + w)          w half the gap [rad, m]
Reference: Visintin, Differential Models of Hysteresis, 1994.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy
from scipy.interpolate import make_interp_spline

from calibration.errors import NotEnoughData
from calibration.numerics.compiled import njit
from calibration.numerics.lie import rotation_vector

RATE = 100.0  # common grid [Hz]
GAP = 0.05  # [s] longer holes in a recording are not compared
_ORDER = 2  # of the Butterworth filter; run forth and back, so 4
CUTOFF = 10.0  # [Hz]


@dataclass(frozen=True)
class Signal:
    """Channels on an even grid of one clock.

    Attributes:
        t: (n,) [s], spacing 1 / RATE.
        x: (n, c).
        valid: (n,) False inside holes of the recording.
    """

    t: np.ndarray
    x: np.ndarray
    valid: np.ndarray


def even(t: np.ndarray, x: np.ndarray) -> Signal:
    """Samples x (n, c) at t (n,) [s] on an even grid, cubic, linear across holes; rows with NaN are left out.

    Raises:
        NotEnoughData: Fewer than one second of samples.
    """
    good = np.isfinite(x).all(axis=1)
    t, x = t[good], x[good]
    if len(t) < 4 or t[-1] - t[0] < 1.0:
        raise NotEnoughData("less than one second of samples; record the motion with a second of rest on both sides")
    grid = t[0] + np.arange(int((t[-1] - t[0]) * RATE) + 1) / RATE
    right = np.clip(np.searchsorted(t, grid), 1, len(t) - 1)
    found, valid = make_interp_spline(t, x)(grid), np.diff(t)[right - 1] <= GAP
    if not valid.all():
        found[~valid] = interpolate_columns(grid[~valid], t, x)
    return Signal(grid, found, valid)


def low_passed(signal: Signal, cutoff: float) -> Signal:
    """The signal without what is faster than `cutoff` [Hz]; zero phase."""
    pad = min(len(signal.t) - 1, int(2.0 * RATE))
    return Signal(signal.t, scipy.signal.sosfiltfilt(_sections(cutoff), signal.x, axis=0, padlen=pad), signal.valid)


@lru_cache
def _sections(cutoff: float) -> np.ndarray:
    return np.asarray(scipy.signal.butter(_ORDER, cutoff, fs=RATE, output="sos"))


def interpolate_columns(at: np.ndarray, t: np.ndarray, x: np.ndarray, outside: float | None = None) -> np.ndarray:
    """Columns x (n, c) at t (n,), linear, at times `at` (m,); beyond the ends `outside`, or the end's value if None."""
    return np.stack([np.interp(at, t, column, left=outside, right=outside) for column in x.T], axis=1)


def body_rates(t: np.ndarray, R: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angular velocity in the body's axes (n - 1, 3) [rad/s] at mid times, from rotations R (n, 3, 3) at t [s].

    w = log3(R_k' R_{k+1}) / dt; rotations with NaN are left out.
    """
    good = np.isfinite(R).all(axis=(1, 2))
    t, R = t[good], R[good]
    step = rotation_vector(np.swapaxes(R[:-1], 1, 2) @ R[1:])
    return 0.5 * (t[:-1] + t[1:]), step / np.diff(t)[:, None]


def play(q: np.ndarray, half_gap: np.ndarray) -> np.ndarray:
    """Output p of play operators of half gaps (k,) driven by columns q (n, k), starting centred on q[0]."""
    return np.asarray(_played(np.array(q, dtype=float, order="C"), np.broadcast_to(half_gap, q.shape[1]).astype(float)))


@njit(cache=True, error_model="numpy")
def _played(q: np.ndarray, half_gap: np.ndarray) -> np.ndarray:
    for j in range(q.shape[1]):
        last = q[0, j]
        for k in range(len(q)):
            last = min(max(last, q[k, j] - half_gap[j]), q[k, j] + half_gap[j])
            q[k, j] = last
    return q
