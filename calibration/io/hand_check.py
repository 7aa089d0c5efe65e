"""Columns of joints that are swapped or reversed, told by the hand's markers before anything is written.

    e_h = mean_i min(|d_i|, 0.5 m),   d_i = (p, L w) of (X A_i(h) Y)^-1 B_i        L = 0.2 m

A_i(h) is the nominal robot's T_base_hand at the readings under hypothesis h (as declared; one joint reversed; two
joints swapped), B_i the measured one; X and Y are two constant frames fitted to all of them (hand-eye), so that no
drawing is needed. A robot is a centimetre or two off its nominal model, a column that is another's by the motion
itself: where one hypothesis explains the hand better than the declaration by a factor, it is named.
A joint that does not move, or two that turn about one line, cannot be told apart so; then nothing is said.

Clocks are not known yet: the robot's is brought to the markers' by the hand's speed of rotation, for each hypothesis.
"""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from calibration.bodies import poses_of
from calibration.errors import InputError, NotEnoughData
from calibration.io.place_bodies import hand_eye
from calibration.labels import with_right_labels
from calibration.lag import coarse_lag
from calibration.markers import base_body, hand_body
from calibration.means import PostureMeans
from calibration.postures import mean_postures
from calibration.recording import Trial
from calibration.registration_start import registration_start
from calibration.robot import Chain
from calibration.schema import Description
from calibration.se3 import inverse, rotation_vector
from calibration.signals import Signal, body_rates, even, low_passed

_ARM, _MOST = 0.2, 0.5  # [m] what a radian of the hand is worth; what a sample counts at most
_CUTOFF = 3.0  # [Hz]
_STEP = 0.04  # [s] between readings the speed is taken from
_POSES, _FEWEST, _ENOUGH = 60, 6, 10  # compared, of all trials; of each at least; to judge by
_OFF, _ANOTHER = 0.012, 0.06  # [m] no suspicion; another robot than the nominal one
_CLEAR = 1.5  # so many times better is an explanation
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Reading:
    """How the columns q (n, k) of a file are taken: q'_j = sign_j q_order_j."""

    order: tuple[int, ...]
    sign: tuple[float, ...]
    said: str = ""

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

    def pairs(self, chain: Chain, reading: Reading, most: int) -> tuple[np.ndarray, np.ndarray]:
        """A, B (n, 4, 4) of about `most` samples."""
        good, q = np.isfinite(self.T).all(axis=(1, 2)), reading.of(self.q)
        if len(self.t):
            s = self.t - coarse_lag(self.speed, _turning(chain, self.s, q))
            good &= (s > self.s[0]) & (s < self.s[-1])
        rows = np.flatnonzero(good)
        rows = rows[:: max(1, len(rows) // most)]
        at = np.stack([np.interp(s[rows], self.s, c) for c in q.T], axis=1) if len(self.t) else q[rows]
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


def check_columns(description: Description, chain: Chain, trials: Sequence[tuple[str, Trial | PostureMeans]]) -> None:
    """Refuse readings that explain the hand only with a joint reversed or two swapped, or not at all.

    Args:
        description: Of the dataset to be written.
        chain: The nominal chain.
        trials: Of one session, where markers stay as they are, each with the file it came from.

    Raises:
        InputError: It names the files, the joints and the remedy.
    """
    shown = []
    for file, trial in trials:
        try:
            shown.append(_shown(description, file, trial))
        except NotEnoughData as error:
            _log.info("%s: joints not compared with the hand: %s", file, error)
    said = _judge(chain, shown) if shown else None
    if said is not None:
        more = f" and {len(shown) - 1} more" if len(shown) > 1 else ""
        raise InputError(shown[0].file + more, said)


def _shown(description: Description, file: str, trial: Trial | PostureMeans) -> Shown:
    none = np.zeros(0)
    if isinstance(trial, PostureMeans):
        postures = mean_postures(description, trial)
        return Shown(file, postures.T_base_hand, none, postures.q, none, postures.components == 6)
    if len(trial.t_robot) < 2 or not len(trial.marker):
        raise NotEnoughData("readings or markers are missing")
    bodies = base_body(description), hand_body(description)
    mended = with_right_labels(bodies, trial)[0]
    base, hand = (poses_of(body, mended) for body in bodies)
    return Shown(file, inverse(base.T) @ hand.T, trial.t_mocap, trial.q_motor, trial.t_robot)


def _judge(chain: Chain, shown: Sequence[Shown]) -> str | None:
    """What is to be said of the readings, if anything."""
    d = _distances(chain, shown, Reading(tuple(range(len(chain.measured))), (1.0,) * len(chain.measured)))
    if d is None or (off := float(d.mean())) < _OFF:
        return None
    found = [(float(d_h.mean()), r.said) for r in _readings(chain) if (d_h := _distances(chain, shown, r)) is not None]
    left, said = min(found, default=(off, ""))
    far = f"the hand's markers are {1e3 * off:.0f} mm (mean) from where the readings put them, frames fitted"
    if left < min(off / _CLEAR, _ANOTHER):
        return f"{said}: {far}, {1e3 * left:.0f} mm otherwise; correct the mapping file"
    if float(np.median(d)) > _ANOTHER:
        return (
            f"{far}; no joint reversed and no two swapped explain it: columns of several joints or of markers are "
            "swapped, readings are another session's, or this is another robot's URDF"
        )
    return None


def _readings(chain: Chain) -> Iterator[Reading]:
    """Every joint of the chain reversed, every two swapped."""
    k, names = len(chain.measured), chain.measured
    for j in chain.columns:
        yield Reading(
            tuple(range(k)), tuple(-1.0 if i == j else 1.0 for i in range(k)), f"joint {names[j]} is reversed"
        )
    for a, b in combinations(chain.columns, 2):
        order = tuple(b if i == a else a if i == b else i for i in range(k))
        yield Reading(order, (1.0,) * k, f"joints {names[a]} and {names[b]} are swapped")


def _distances(chain: Chain, shown: Sequence[Shown], reading: Reading) -> np.ndarray | None:
    """min(|d_i|, 0.5 m) (n,) of all trials; None where they do not tell the constant frames."""
    try:
        pairs = [x.pairs(chain, reading, max(_FEWEST, _POSES // len(shown))) for x in shown]
        A, B = (np.concatenate(x) for x in zip(*pairs, strict=True))
        if len(A) < _ENOUGH:
            raise NotEnoughData(f"{len(A)} samples show base and hand")
        if not all(x.oriented for x in shown):
            return np.minimum(registration_start(A, B, False).residual, _MOST)
        X, Y = hand_eye(A, B)
    except NotEnoughData as error:
        _log.info("joints not compared with the hand: %s", error)
        return None
    d = inverse(X @ A @ Y) @ B
    r = np.column_stack([d[:, :3, 3], _ARM * rotation_vector(d[:, :3, :3])])
    return np.minimum(np.linalg.norm(r, axis=1), _MOST)
