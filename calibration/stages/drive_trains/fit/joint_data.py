"""What one joint did in the calibration trials: motor minus link reading to explain, in windows of a tenth of a second.

    y = q_motor - q_link = zero + e(theta) + delta + noise          e = e_m - e_l, once and twice per turn

Encoders differ by their zero and by both eccentricities together: the difference of two readings shows the sum.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from calibration.numerics.compiled import njit
from calibration.stages.drive_trains.drive_train import LONGEST, DriveMotion, DriveTrain, drive_motion, harmonic_terms
from calibration.stages.drive_trains.kernel.link_motion import Drive
from calibration.stages.drive_trains.torques import LinkLoads

WINDOW, COARSE = 0.1, 0.5  # [s]
CORRELATED = 1.5  # [s] readings' errors hang together
RELAXATION = 6e-3  # [s] a link that strikes rings little, as what carries it yields
ON_BASE = 12e-3  # [s] of a link that turns the base as it strikes: a base whose motion is given does not yield
_START = 0.3  # [s] of a trial's rest that show where delta starts
REGIMES, REST = 3, 2
_FEW = 20  # windows
_PARTS = 4  # of a single trial, left out in turn
_SLIDES, _RESTS = 0.05, 0.01  # [rad/s] a motor that moves all through a window, or does not
_STEADY = 1.5  # [rad/s2]


@dataclass(frozen=True)
class JointData:
    """One joint in m trials, k windows in all.

    Attributes:
        trial_ids: The trials, length m.
        motion: Of motor and load, nominal torques.
        modes: (n, z) torque by unit modes of the inertial parameters [N.m].
        first: (k,) first sample of each window.
        trial: (k,) which trial a window is of.
        regime: (k,) 0 steady sliding, 1 starts, stops and jolts, 2 rest: what is left of each differs in size.
        y: (k,) motor minus link reading, mean over the window [rad], NaN where there is none.
        terms: (k, 5) 1, cos, sin, cos 2, sin 2 of the joint's angle.
        weight: (k,) of each window, 1 where all are alike, 0 of one that does not count.
        window: Its length [s].
        correlated: How long errors hang together [s].
        relaxation: Time of the contact, which readings at 100 Hz hardly show [s].
    """

    trial_ids: tuple[str, ...]
    motion: DriveMotion
    modes: np.ndarray
    first: np.ndarray
    trial: np.ndarray
    regime: np.ndarray
    y: np.ndarray
    terms: np.ndarray
    weight: np.ndarray
    window: float = WINDOW
    correlated: float = CORRELATED
    relaxation: float = RELAXATION

    @cached_property
    def group(self) -> np.ndarray:
        """(k,) windows whose residuals are of one size: those of one regime in one trial."""
        return REGIMES * self.trial + self.regime

    @property
    def n_groups(self) -> int:
        """One more than the largest `group` there can be."""
        return REGIMES * len(self.trial_ids)

    def means(self, x: np.ndarray) -> np.ndarray:
        """Means (k, ...) over the windows of x (n, ...)."""
        return window_means(x, self.first)

    def loaded(self, z: np.ndarray) -> DriveMotion:
        """The motion with torque modes z (z,)."""
        return replace(self.motion, torque=self.motion.torque + self.modes @ z)

    def delta(self, of: DriveTrain, z: np.ndarray, zero: np.ndarray, off: float = 0.0) -> np.ndarray:
        """Window means (k,) of delta [rad], started where y less `terms @ zero` shows it, with torque modes z.

        A torque that is `off` [N.m] everywhere shows in the side of the mesh and not in how far it is wound up.
        """
        torque = self.motion.torque + self.modes @ z + of.link_inertia * self.motion.a + off
        low, high = of.ends(torque[self.motion.begins[:-1]])
        starts = np.clip(np.where(np.isfinite(seen := self.started(zero)), seen, 0.5 * (low + high)), low, high)
        longest = LONGEST if self.window == WINDOW else 1.5 * LONGEST
        return self.means(of.deltas(self.motion, torque, starts, longest)) - of.values[1] * off

    def played(self, values: np.ndarray, z: np.ndarray, zero: np.ndarray) -> np.ndarray:
        """`delta` (l, k) of l dead zones without inertia: g, c, f_c, f_v and link's inertia (l, 5), modes z (l, z)."""
        m, seen, (g, c, f, _, inertia) = self.motion, self.started(zero), values.T[:, None]
        at = m.begins[:-1]
        base, shift = m.torque + self.modes @ z[0], (z - z[0]).T
        torque = base[at, None] + m.a[at, None] * inertia + self.modes[at] @ shift
        low, high = torque - f, torque + f
        low, high = c * low + g * np.sign(low), c * high + g * np.sign(high)
        starts = np.clip(np.where(np.isfinite(seen)[:, None], seen[:, None], 0.5 * (low + high)), low, high)
        drive = Drive(m.t, m.q, m.v, base, m.inertia, np.zeros(len(m.q)))
        lanes = np.ascontiguousarray(values.T)
        found = _played_means(drive, m.a, self.modes, m.begins, self.first, starts, lanes, np.ascontiguousarray(shift))
        return np.asarray(found.T)

    def started(self, zero: np.ndarray) -> np.ndarray:
        """delta (m,) where each trial starts, as y less `terms @ zero` shows it; NaN where it does not."""
        rest = self.y - self.terms @ zero
        return np.asarray(rest[self._opening].mean(axis=1))

    @cached_property
    def _opening(self) -> np.ndarray:
        """Windows (m, ...) in which each trial starts."""
        begins = np.searchsorted(self.trial, np.arange(len(self.trial_ids)))
        return np.minimum(begins[:, None] + np.arange(max(1, round(_START / self.window))), len(self.trial) - 1)

    @cached_property
    def part(self) -> np.ndarray:
        """(k,) what is left out with a window: its trial or, of a single trial, a quarter of its time."""
        k = len(self.trial)
        return self.trial if len(self.trial_ids) > 1 else np.arange(k) * _PARTS // k

    def without(self, trial: int) -> "JointData":
        """The data with the readings of one trial left out."""
        return replace(self, y=np.where(self.trial == trial, np.nan, self.y))

    @property
    def moves(self) -> np.ndarray:
        """(k,) known windows in motion; all known ones where there are none."""
        moves = self.known & (self.regime != REST)
        return moves if moves.any() else self.known

    @property
    def sliding(self) -> "JointData":
        """The data where the joint slides steadily alone; all of it where it never does."""
        slides = (self.regime == 0) & np.isfinite(self.y)
        return self.counting(slides) if slides.sum() > _FEW else self

    def counting(self, rows: np.ndarray) -> "JointData":
        """The data in which only the windows of a mask (k,) count."""
        return replace(self, weight=np.where(rows, self.weight, 0.0))

    @cached_property
    def known(self) -> np.ndarray:
        """(k,) windows that count."""
        return np.isfinite(self.y) & (self.weight > 0.0)

    def only(self, trial: int) -> "JointData":
        """The data of one trial alone."""
        start, stop = self.motion.begins[trial : trial + 2]
        rows = np.flatnonzero(self.trial == trial)
        m, own = self.motion, slice(start, stop)
        motion = DriveMotion(
            m.t[own], m.q[own], m.v[own], m.a[own], m.torque[own], m.inertia[own], np.array([0, stop - start])
        )
        return JointData(
            self.trial_ids[trial : trial + 1], motion, self.modes[own],
            self.first[rows] - start, np.zeros(len(rows), dtype=int), self.regime[rows], self.y[rows],
            self.terms[rows], self.weight[rows], self.window, self.correlated, self.relaxation,
        )  # fmt: skip


def joint_data(
    loads: Sequence[LinkLoads],
    differences: Sequence[np.ndarray],
    column: int,
    modes: np.ndarray,
    window: float = WINDOW,
    relaxation: float = RELAXATION,
) -> JointData:
    """A joint's trials; differences (n, k) of each trial are motor minus link readings, `modes` (p, z) of dphi."""
    motion = drive_motion(loads, column)
    first, trial = [], []
    for i, (start, stop) in enumerate(pairwise(motion.begins)):
        edges = windows(motion.t[start:stop], window)
        first.append(start + edges)
        trial.append(np.full(len(edges), i))
    n = sum(map(len, first))
    bare = JointData(
        tuple(of_trial.trial_id for of_trial in loads), motion,
        np.concatenate([of_trial.regressor[:, column] for of_trial in loads]) @ modes,
        np.concatenate(first), np.concatenate(trial), _regimes(motion, np.concatenate(first)), np.zeros(0),
        np.zeros((0, 5)), np.ones(n), window, relaxation=relaxation,
    )  # fmt: skip
    angle = bare.means(np.concatenate([of_trial.angle[:, column] for of_trial in loads]))
    terms = np.column_stack([np.ones(len(angle)), harmonic_terms(angle)])
    return replace(bare, y=bare.means(np.concatenate(differences)[:, column]), terms=terms)


def windows(t: np.ndarray, window: float = WINDOW) -> np.ndarray:
    """(k,) first samples of windows of times (n,) [s]."""
    return np.unique(np.searchsorted(t, np.arange(t[0], t[-1] - 0.5 * window, window)))


def window_means(x: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Means (k, ...) of x (n, ...) over windows that begin at samples `first` (k,)."""
    count = np.diff(np.append(first, len(x)))
    return np.asarray(np.add.reduceat(x, first, axis=0) / count.reshape(-1, *[1] * (x.ndim - 1)))


def _regimes(motion: DriveMotion, first: np.ndarray) -> np.ndarray:
    """`JointData.regime` of windows that begin at samples `first` (k,)."""
    v, a = np.abs(motion.v), np.abs(motion.a)
    slides = (np.minimum.reduceat(v, first) > _SLIDES) & (np.maximum.reduceat(a, first) < _STEADY)
    rests = np.maximum.reduceat(v, first) < _RESTS
    return np.where(slides, 0, np.where(rests, REST, 1))


@njit(cache=True, error_model="numpy")
def _played_means(  # noqa: C901, PLR0913  compiled: arrays alone
    drive: Drive, a: np.ndarray, modes: np.ndarray, begins: np.ndarray, first: np.ndarray, starts: np.ndarray,
    lanes: np.ndarray, shift: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Means (k, l) over windows that begin at samples `first` (k,), of the play operators of l drives at once.

    `lanes` (5, l) are g, c, f_c, f_v and the inertia that accelerations a (n,) load beside the torque, `shift` (z, l)
    of the torque by modes (n, z), `starts` (m, l) as in `played`.
    """
    n, l = len(drive.q), lanes.shape[1]
    out, x, t, w = np.zeros((len(first), l)), np.empty(l), np.empty(l), -1
    for m in range(len(starts)):
        for i in range(begins[m], begins[m + 1]):
            if w + 1 < len(first) and first[w + 1] == i:
                w += 1
            if i == begins[m]:
                for p in range(l):
                    x[p] = starts[m, p]
            else:
                dq, torque, v, dv = drive.q[i] - drive.q[i - 1], drive.torque[i], drive.v[i], a[i]
                for p in range(l):
                    t[p] = torque + lanes[4, p] * dv + lanes[3, p] * v
                for j in range(modes.shape[1]):
                    for p in range(l):
                        t[p] += modes[i, j] * shift[j, p]
                for p in range(l):
                    g, c, below, above = lanes[0, p], lanes[1, p], t[p] - lanes[2, p], t[p] + lanes[2, p]
                    low = c * below + (g if below > 0.0 else -g if below < 0.0 else 0.0)
                    high = c * above + (g if above > 0.0 else -g if above < 0.0 else 0.0)
                    x[p] = min(max(x[p] + dq, low), high)
            for p in range(l):
                out[w, p] += x[p]
    for w in range(len(first)):
        since = (first[w + 1] if w + 1 < len(first) else n) - first[w]
        for p in range(l):
            out[w, p] /= since
    return out
