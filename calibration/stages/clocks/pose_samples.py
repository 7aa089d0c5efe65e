"""Base, hand and readings of one trial on the motion capture's clock, to compare clocks by.

Rates come from readings without what is faster than 6 Hz, zero phase: stamps that jitter by a millisecond would
otherwise look like accelerations of 5 rad/s2. The readings themselves stay as they are: what jitter adds to them is
white and averages out over thousands of samples.
"""

from dataclasses import dataclass, fields

import numpy as np
from scipy.ndimage import maximum_filter1d

from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.signals import RATE, Signal, even, interpolate_columns, low_passed, play
from calibration.recording.clock import Clock

_WIDTHS = (1.0, 4.0)  # half widths of the play operators, of the datasheet's windup by dry friction
_CUTOFF = 6.0  # [Hz] of the readings, for their rates
_STRIDE = 2  # motion-capture samples
_ENOUGH = 100  # samples
_JERK, _AFTER = 3.0, 0.3  # samples within _AFTER [s] of faster accelerations [rad/s2, m/s2] are left out: links bounce


@dataclass(frozen=True)
class Samples:
    """One trial on the motion capture's clock, where base and hand are seen.

    Attributes:
        t: (n,) [s].
        q: (n, n_measured) readings [rad, m].
        v: (n, n_measured) their rates [rad/s, m/s].
        lost: (n, n_measured, n_widths) what narrow play operators add to a reading [rad, m].
        T: (n, 4, 4) measured T_B_H.
        covariance: (n, 6, 6) of its local twist [m, rad].
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    lost: np.ndarray
    T: np.ndarray
    covariance: np.ndarray

    def thinned(self, stride: int) -> "Samples":
        """One sample of so many; all of them where too few would be left."""
        every = stride if len(self.t) >= stride * _ENOUGH else 1
        return Samples(*(getattr(self, f.name)[::every] for f in fields(self)))


def read_samples(trial: MeasuredTrial, clock: Clock, calm: bool) -> Samples:
    """Every other sample, without jerky motion if only `calm` ones are wanted.

    Raises:
        NotEnoughData: Base and hand are hardly in view, or nothing is calm.
    """
    s, T = clock.from_mocap(trial.t_mocap), trial.T_base_hand
    slow = low_passed(even(trial.t_robot, trial.q_motor), _CUTOFF)
    rates = np.gradient(slow.x, 1.0 / RATE, axis=0)
    q = interpolate_columns(s, trial.t_robot, trial.q_motor, np.nan)
    v = interpolate_columns(s, slow.t, rates, np.nan)
    gaps = (
        play(slow.x, np.full(q.shape[1], w)) - slow.x
        for w in np.multiply(_WIDTHS, trial.description.tolerances.joint_windup)
    )
    lost = np.stack([interpolate_columns(s, slow.t, gap, np.nan) for gap in gaps], axis=2)
    wanted = np.interp(s, slow.t, (_is_calm(slow, rates) | (not calm)).astype(float), 0.0, 0.0) == 1.0
    rows = np.flatnonzero(wanted & np.isfinite(q).all(axis=1) & np.isfinite(T).all(axis=(1, 2)))[::_STRIDE]
    if len(rows) < _ENOUGH:
        raise NotEnoughData("base and hand are hardly in view, or all motion is jerky")
    return Samples(trial.t_mocap[rows], q[rows], v[rows], lost[rows], T[rows], trial.covariance(rows))


def _is_calm(slow: Signal, rates: np.ndarray) -> np.ndarray:
    """(n,) False within `_AFTER` of fast accelerations, and in holes of the recording."""
    jerked = np.abs(np.gradient(rates, 1.0 / RATE, axis=0)).max(axis=1) > _JERK
    near = maximum_filter1d(jerked.astype(float), 2 * int(_AFTER * RATE) + 1)
    return (near == 0.0) & slow.valid
