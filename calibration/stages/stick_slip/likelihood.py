"""Likelihood of the stick-slip parameters: windows whose variances are unknown, one for each window and axis.

    -2 log L = sum_w sum_a  n_w log(var_w (x - x(p))_a + s_a^2),        n_w samples that are independent

Windows of 4 s overlap by half, each relative to its own mean: what slipped before a window is no error of it, so that
errors of a hundred slips do not add up along a trial, and a window that slips as nobody could know counts little. s is
the noise of the markers. Parameters are logarithms and the load's place, p with a normal prior.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from calibration.numerics.compiled import njit
from calibration.numerics.side_by_side import side_by_side
from calibration.numerics.signals import RATE
from calibration.stages.stick_slip.forcing import PlanarForcing, planar_force
from calibration.stages.stick_slip.kernel.bases import Bases, at_rest
from calibration.stages.stick_slip.kernel.integration import simulated
from calibration.stages.stick_slip.measured import BLOCK, PlanarMotion, pooled_noise
from calibration.stages.stick_slip.wheels import NAMES, WIDE, Prior, WheelSet, values_of
from calibration.stages.suspension.model import Source

CORRECTION = (130.0, 0.1)  # rate g [1/s] of the plate's correction and l [-], see `kernel.corrector`
WINDOW = round(4.0 * RATE / BLOCK)  # blocks
_MEMORY = 1.0  # [s] between independent samples of the error
_FAR = 0.2  # [m, rad] an error that counts as no larger
DIFFERENCE = 0.01  # of a logarithm, for derivatives


@dataclass(frozen=True)
class Trials:
    """Forcings and measured motions of calibration trials, one after the other.

    Attributes:
        ids: Of the trials.
        wheels: The robot's.
        corrected: Whether a plate corrects the prediction.
        starts: (k + 1,) first sample of each trial, and the number of samples.
        drive: (steps n, 13).
        inertia: (n, 15).
        rest: (n,) True in the first second of a trial.
        motions: Measured.
        prior: Of the logarithms.
    """

    ids: tuple[str, ...]
    wheels: WheelSet
    corrected: bool
    starts: np.ndarray
    drive: np.ndarray
    inertia: np.ndarray
    rest: np.ndarray
    motions: tuple[PlanarMotion, ...]
    prior: Prior = WIDE

    @cached_property
    def spans(self) -> tuple[tuple[int, int], ...]:
        """First sample of each trial, and of the next."""
        return tuple((int(a), int(b)) for a, b in pairwise(self.starts))

    @cached_property
    def noise(self) -> np.ndarray:
        """(3,) of a block."""
        return pooled_noise(self.motions)

    @cached_property
    def windows(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Trial (w,) of each window, its blocks (w, WINDOW) among all, and whether they count (w, WINDOW)."""
        trial, index, counts, before = [], [], [], 0
        for k, motion in enumerate(self.motions):
            b = len(motion.valid)
            for start in range(0, max(b - WINDOW // 2, 1), WINDOW // 2):
                rows = np.arange(start, start + WINDOW)
                inside = rows < b
                rows = np.minimum(rows, b - 1)
                trial.append(k)
                index.append(before + rows)
                counts.append(inside & motion.valid[rows])
            before += b
        return np.array(trial), np.array(index), np.array(counts)

    @cached_property
    def measured(self) -> np.ndarray:
        """(b, 3) of all trials."""
        return np.concatenate([m.x for m in self.motions])

    @property
    def steps(self) -> int:
        """Of the integration to a sample."""
        return len(self.drive) // len(self.inertia)

    @property
    def _step(self) -> float:
        return 1.0 / (RATE * self.steps)

    @property
    def coarse(self) -> "Trials":
        """The same in one step to a sample."""
        return replace(self, drive=np.ascontiguousarray(self.drive[self.steps - 1 :: self.steps]))

    @property
    def loads(self) -> np.ndarray:
        """(k, 3) (-Fz, My, -Mx) under which each trial begins."""
        return self.drive[self.steps * self.starts[:-1], 3:6]

    def force(self, source: Source) -> np.ndarray:
        """(n, 3) change of Fx, Fy, Mz on the floor, by its source."""
        return planar_force(self.drive, source, self.steps)

    def alone(self, k: int) -> "Trials":
        """Trial k alone."""
        a, b = self.spans[k]
        drive, inertia, rest = self.drive[self.steps * a : self.steps * b], self.inertia[a:b], self.rest[a:b]
        motions = self.motions[k : k + 1]
        ids, starts = self.ids[k : k + 1], np.array([0, b - a])
        return Trials(ids, self.wheels, self.corrected, starts, drive, inertia, rest, motions, self.prior)

    def simulated(self, logarithms: np.ndarray, preload: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Positions (k, n, 3) since the first second of each trial, and shares of wheels that slid (k, n).

        By parameters (k, p); the wheels' deflections (k, m, 2) at the start of each trial may be given.
        """
        bases = bases_of(self.wheels, logarithms, self.corrected, preload)
        x, share, _ = simulated(self.starts, self.drive, self.inertia, bases, self._step, len(logarithms))
        for a, b in self.spans:
            x[:, a:b] -= x[:, a:b][:, self.rest[a:b]].mean(axis=1, keepdims=True)
        return x, share

    def errors(self, logarithms: np.ndarray, places: np.ndarray | None = None) -> list[np.ndarray]:
        """By each of some parameters (k, p), and places of the wheels (k, m, 2) other than declared, see `error`."""
        bases = bases_of(self.wheels, logarithms, self.corrected, places=places)
        x, _, _ = simulated(self.starts, self.drive, self.inertia, bases, self._step, len(logarithms), BLOCK)
        return side_by_side(self.error, x)

    def error(self, x: np.ndarray) -> np.ndarray:
        """Measured minus predicted x (b, 3), by window (w, WINDOW, 3), its mean taken off; 0 where it does not count.

        x are means of blocks, from any origin. A base that no step can follow is `_FAR` off, to one side and the other:
        no mean of a window takes that away.
        """
        _, index, counts = self.windows
        off, other = self.measured - x, np.where(np.arange(len(x)) % 2, -_FAR, _FAR)[:, None]
        return np.asarray(_by_window(np.where(np.abs(off) <= _FAR, off, other), index, counts))

    @cached_property
    def independent(self) -> np.ndarray:
        """n_w (w,): windows overlap by half."""
        return self.windows[2].sum(axis=1) * (0.5 * BLOCK / RATE / _MEMORY)

    def variances(self, errors: np.ndarray) -> np.ndarray:
        """Of each window and axis (w, 3), noise included."""
        count = np.maximum(self.windows[2].sum(axis=1), 1)
        return np.asarray(np.einsum("wia,wia->wa", errors, errors) / count[:, None] + self.noise**2)

    def cost(self, logarithms: np.ndarray, errors: np.ndarray) -> float:
        """-2 log of the posterior."""
        return float(self.costs(errors).sum() + self.prior.cost(logarithms))

    def costs(self, errors: np.ndarray) -> np.ndarray:
        """-2 log of the likelihood of each trial (k,)."""
        rows = (self.independent[:, None] * np.log(self.variances(errors))).sum(axis=1)
        return np.bincount(self.windows[0], rows, len(self.ids))

    def normal(self, logarithms: np.ndarray, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Information (k, p, p) and gradient (k, p) of half the cost of each trial, prior left out."""
        steps = DIFFERENCE * np.eye(len(logarithms))
        return self.weighed(np.array(self.errors(logarithms + steps)) - errors, steps, errors)

    def weighed(self, E: np.ndarray, steps: np.ndarray, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same by what each of the steps (p, p), one a row, adds to the errors, E (p, w, WINDOW, 3)."""
        p, J = len(steps), np.tensordot(np.linalg.inv(steps), E, 1)
        trial, _, _ = self.windows
        count = np.maximum(self.windows[2].sum(axis=1), 1)
        weight = (self.independent / count)[:, None] / self.variances(errors)
        root = np.sqrt(weight)[:, None, :]
        H, g = np.zeros((len(self.ids), p, p)), np.zeros((len(self.ids), p))
        for k in range(len(self.ids)):
            own = trial == k
            A = (J[:, own] * root[own]).reshape(p, -1)
            H[k], g[k] = A @ A.T, A @ (errors[own] * root[own]).ravel()
        return H, g


@njit(cache=True, error_model="numpy")
def _by_window(e: np.ndarray, index: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """`Trials.error` of errors (b, 3)."""
    out = np.zeros((index.shape[0], index.shape[1], 3))
    for w in range(len(index)):
        for a in range(3):
            total, count = 0.0, 0
            for i in range(index.shape[1]):
                if counts[w, i]:
                    total, count = total + e[index[w, i], a], count + 1
            for i in range(index.shape[1]):
                if counts[w, i]:
                    out[w, i, a] = e[index[w, i], a] - total / count
    return out


def bodies(values: np.ndarray, corrected: bool) -> np.ndarray:
    """(k, 4) as the kernel takes them, by parameters (k, 17) in the order of NAMES."""
    found = np.empty((len(values), 4))
    found[:, :2] = values[:, [NAMES.index("body_c"), NAMES.index("body_cr")]]
    found[:, 2:] = CORRECTION[0] if corrected else 0.0, CORRECTION[1]
    return found


def bases_of(
    wheels: WheelSet,
    logarithms: np.ndarray,
    corrected: bool,
    preload: np.ndarray | None = None,
    places: np.ndarray | None = None,
    noise: np.ndarray | None = None,
) -> Bases:
    """Bases of parameters (k, p), preloaded by deflections (k, m, 2), on wheels at other places (k, m, 2).

    Judged by a plate's force, sigma (3,) [N, N.m], where that is given.
    """
    values = values_of(logarithms)
    return at_rest(wheels.each(values, places), bodies(values, corrected), preload, noise)


def joined(wheels: WheelSet, rows: Sequence[tuple[PlanarForcing, PlanarMotion]], prior: Prior = WIDE) -> Trials:
    """Trials of one source one after the other."""
    forcings, motions = zip(*rows, strict=True)
    return Trials(
        tuple(f.trial_id for f in forcings),
        wheels,
        forcings[0].source == "plate",
        np.cumsum([0, *(len(f.t) for f in forcings)]),
        np.ascontiguousarray(np.concatenate([f.drive for f in forcings])),
        np.ascontiguousarray(np.concatenate([f.inertia for f in forcings])),
        np.concatenate([f.rest for f in forcings]),
        motions,
        prior,
    )
