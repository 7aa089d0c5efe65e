"""How the columns of joint readings may be meant, and where the nominal hand is under each of them.

    q'_j = sign_j q_order_j                d_i = (p, L w) of (X A_i Y)^-1 B_i          L = 0.2 m

A_i the nominal T_base_hand at the readings so taken, B_i the measured one, X and Y two constant frames.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from calibration.numerics.lie import inverse, rotation_vector
from calibration.numerics.signals import Signal, body_rates, even, interpolate_columns, low_passed
from calibration.numerics.time_delay import coarse_lag
from calibration.robot.chain import Chain

MOST = 0.5  # [m] what a sample counts at most
_ARM = 0.2  # [m] what a radian of the hand is worth
_CUTOFF = 3.0  # [Hz]
_STEP = 0.04  # [s] between readings the speed is taken from

Pairs = tuple[np.ndarray, np.ndarray]
"""A, B (n, 4, 4) of a file."""
Frames = tuple[np.ndarray, np.ndarray]
"""X, Y (4, 4)."""


@dataclass(frozen=True)
class Reading:
    """How the columns q (n, k) of a file are taken: q'_j = sign_j q_order_j."""

    order: tuple[int, ...]
    sign: tuple[float, ...]
    meaning: str = ""

    def of(self, q: np.ndarray) -> np.ndarray:
        """The readings (n, k) so taken."""
        return q[:, self.order] * np.array(self.sign)


@dataclass(frozen=True)
class Shown:
    """What a trial shows of the hand.

    Attributes:
        file: It came from.
        T: (n, 4, 4) measured T_B_H.
        t: (n,) [s, mocap clock]; empty where q belongs to T row by row.
        q: (m, k) readings as declared [rad, m].
        s: (m,) [s, robot clock].
        oriented: False where one marker shows positions only.
    """

    file: str
    T: np.ndarray
    t: np.ndarray
    q: np.ndarray
    s: np.ndarray
    oriented: bool = True

    @cached_property
    def speed(self) -> Signal:
        """How fast the hand turns [rad/s]."""
        return _speed(*body_rates(self.t, self.T[:, :3, :3]))

    def lag(self, chain: Chain, reading: Reading) -> float:
        """How much later the mocap's clock is by the hand's speed of rotation [s]; NaN where q belongs to T row by row.

        Raises:
            NotEnoughData: Samples are too few to estimate a speed.
        """
        return coarse_lag(self.speed, _turning(chain, self.s, reading.of(self.q))) if len(self.t) else np.nan

    def pairs(self, chain: Chain, reading: Reading, most: int, lag: float | None = None) -> Pairs:
        """A, B (n, 4, 4) of about `most` samples; the lag is its own where none is given.

        Raises:
            NotEnoughData: As `lag`.
        """
        good, q = np.isfinite(self.T).all(axis=(1, 2)), reading.of(self.q)
        if len(self.t):
            s = self.t - (self.lag(chain, reading) if lag is None else lag)
            good &= (s > self.s[0]) & (s < self.s[-1])
        rows = np.flatnonzero(good)
        rows = rows[:: max(1, len(rows) // most)]
        at = interpolate_columns(s[rows], self.s, q) if len(self.t) else q[rows]
        return chain.poses(at), self.T[rows]


def _turning(chain: Chain, t: np.ndarray, q: np.ndarray) -> Signal:
    """How fast the nominal hand turns along readings q (n, k) at t (n,) [s]."""
    step = max(1, round(_STEP / float(np.median(np.diff(t)))))
    t, q = t[::step], q[::step]
    J = chain.joint_jacobians(0.5 * (q[1:] + q[:-1]))[:, 3:]
    w = (J @ np.diff(q[:, chain.columns], axis=0)[..., None])[..., 0] / np.diff(t)[:, None]
    return _speed(0.5 * (t[1:] + t[:-1]), w)


def _speed(t: np.ndarray, w: np.ndarray) -> Signal:
    found = low_passed(even(t, w), _CUTOFF)
    return Signal(found.t, np.linalg.norm(found.x, axis=1, keepdims=True), found.valid)


def as_declared(chain: Chain) -> Reading:
    """Columns as the file names them."""
    k = len(chain.measured)
    return Reading(tuple(range(k)), (1.0,) * k)


def readings(chain: Chain) -> Iterator[Reading]:
    """Every joint of the chain reversed, every two swapped."""
    k, names = len(chain.measured), chain.measured
    for j in chain.columns:
        yield Reading(
            tuple(range(k)), tuple(-1.0 if i == j else 1.0 for i in range(k)), f"joint {names[j]} is reversed"
        )
    for a, b in combinations(chain.columns, 2):
        order = tuple(b if i == a else a if i == b else i for i in range(k))
        yield Reading(order, (1.0,) * k, f"joints {names[a]} and {names[b]} are swapped")


def distance(frames: Frames, A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """min(|d_i|, 0.5 m) (n,) under frames X, Y."""
    X, Y = frames
    d = inverse(X @ A @ Y) @ B
    r = np.column_stack([d[:, :3, 3], _ARM * rotation_vector(d[:, :3, :3])])
    return np.minimum(np.linalg.norm(r, axis=1), MOST)
