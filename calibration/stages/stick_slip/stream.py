"""The stick-slip base sample by sample: each member of the ensemble is carried from one sample to the next.

    state_e(t + dt) = advance(state_e(t), sample),     x = mean_e x_e,    V as in `band`

The first second is the rest the forces count from. Between two samples they are linear; nothing after a sample is
used. Inverse dynamics are of the motors here, of the links in a recording. Without them, which need accelerations, the
base has no inertia, and the plate alone moves it.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from calibration.numerics.compiled import njit
from calibration.recording.trial import REST
from calibration.stages.stick_slip.band import banded
from calibration.stages.stick_slip.forcing import UNMOVED, Tilting
from calibration.stages.stick_slip.kernel.bases import (
    COLUMNS,
    LANES,
    MISSED,
    PLATE,
    STEPS,
    TILTS,
    UNLIKELY,
    Bases,
    X,
    at_rest,
    judge,
)
from calibration.stages.stick_slip.kernel.informed import informed, learn
from calibration.stages.stick_slip.kernel.integration import advance
from calibration.stages.stick_slip.kernel.preloaded import noise_at_rest, weighed
from calibration.stages.stick_slip.kernel.wheel_forces import deflect_at_rest
from calibration.stages.stick_slip.likelihood import bodies
from calibration.stages.stick_slip.model import Direction, StickSlip
from calibration.stages.stick_slip.wheels import PRELOADS, WheelSet, preloads, values_of

UNDRIVEN = np.array([0.0] * 3 + [UNMOVED, 0.0, 0.0, UNMOVED, 0.0, UNMOVED])
_NO_REST = np.zeros(8)
_LOADS = np.array([0.0] * 3 + [1.0] * 3 + [0.0] * 7)  # of a sample at rest: the vertical load alone


class Sample(NamedTuple):
    """One sample.

    Attributes:
        t: [s].
        wrench: (6,) action on the floor in frame 0, by the plate [N, N.m].
        heave: (2, 3) z, rx, ry since the first second [m, rad], as the compliance has them, and their accelerations.
        driving: (9,) Fx, Fy, Mz of inverse dynamics, tilt's inertia taken off, and M in the plane, row by row, upper;
            None without.
    """

    t: float
    wrench: np.ndarray
    heave: np.ndarray
    driving: np.ndarray | None = None


class Fitted(NamedTuple):
    """What was fitted.

    Attributes:
        members: Of the ensemble.
        k: Bases: members, then the preloaded optimum.
        compliance: (3, 3) K_0^-1 of the optimum.
        moves: (3,) axes that are moved.
        linear: (3,) axes that the compliance moves, see `loaded_base`.
        off: (2,) of the plate [m], see `Tilting`.
    """

    members: int
    k: int
    compliance: np.ndarray
    moves: np.ndarray
    linear: np.ndarray
    off: np.ndarray


class SlipState(NamedTuple):
    """The base after a sample.

    Attributes:
        start: Time of the first sample [s].
        t: Of the last one.
        rest: (8,) mean of the plate's (Fx, Fy, Mz) and of those of inverse dynamics in the first second, and how the
            base leans then (rx, ry).
        n: Samples in that mean.
        noise: (3,) sum of squares about that mean of the plate's.
        before: (13,) the last sample as the kernel takes it.
        bases: The members, then the preloaded optimum.
        found: (5, 3) see `banded`.
        band: (4, 3) s, r, (p^2 + g^2)^1/2, l of a trial that begins so.
        x: (3,) x, y, yaw [m, rad, frame 0].
    """

    start: float
    t: float
    rest: np.ndarray
    n: int
    noise: np.ndarray
    before: np.ndarray
    bases: Bases
    found: np.ndarray
    band: np.ndarray
    x: np.ndarray

    def variance(self, of: Direction) -> np.ndarray:
        """(3,) of x, or of what the compliance makes of it."""
        return np.where(of.slips, self.found[2], of.plain.variance(self.found[3]))


@dataclass(frozen=True)
class SlipStream:
    """A fitted base made ready for samples.

    Attributes:
        direction: What was fitted with a plate.
        wheel_set: Of the robot.
        wheels: (e, m, 10) of the members, then of the optimum, once for each preload.
        bodies: (e, 4) as the kernel takes them.
        fitted: What was fitted.
        tilting: Compliance of heave and tilt.
    """

    direction: Direction
    wheel_set: WheelSet
    wheels: np.ndarray
    bodies: np.ndarray
    fitted: Fitted
    tilting: Tilting

    def stepped(self, sample: Sample, before: SlipState | None) -> SlipState:
        """The base one sample on; without a state before, this sample is the first at rest."""
        driving = UNDRIVEN if sample.driving is None else sample.driving
        if before is None or sample.t <= before.start + REST:
            row = np.empty(COLUMNS)
            sample_row(sample.wrench, sample.heave, driving, _NO_REST, self.fitted.off, row)
            leans = self.tilting.leans(row[3:6]) if before is None else before.rest[6:]
            rest, row = np.concatenate([row[PLATE:TILTS], row[:3], leans]), row * _LOADS
            row[6:PLATE] = leans
            if before is None:
                return self._first(sample.t, row, rest)
            n, off = before.n + 1, rest - before.rest
            noise = before.noise + off[:3] ** 2 * (n - 1) / n
            bases = self._judging(before.bases, noise / n)
            return before._replace(t=sample.t, rest=before.rest + off / n, n=n, noise=noise, before=row, bases=bases)
        was = before.bases
        bases = Bases(was.state.copy(), was.wheels.copy(), was.lanes, was.learnt.copy())
        row, found = np.empty(COLUMNS), np.empty_like(before.found)
        readings = sample.wrench, sample.heave, driving, before.rest, before.before, before.found
        step_members(bases, readings, self.fitted, before.band, (sample.t - before.t) / STEPS, row, found)
        return before._replace(t=sample.t, before=row, bases=bases, found=found, x=found[1] * self.fitted.moves)

    def _judging(self, bases: Bases, variance: np.ndarray) -> Bases:
        """The same, judged by the plate's force of a variance (3,) where it corrects them."""
        if not self.direction.corrected:
            return bases
        state = bases.state.copy()
        judge(state, noise_at_rest(variance))
        return bases._replace(state=state)

    def _first(self, t: float, row: np.ndarray, rest: np.ndarray) -> SlipState:
        (of, tried), none = self.direction.begun(row[3:6]), np.zeros((5, 3))
        none[2] = of.floor**2
        band = np.array([of.floor, of.spread, of.start, of.slip])
        e = np.zeros((*self.wheels.shape[:2], 2))
        e[len(self.direction.ensemble) :] = tried * preloads(self.wheel_set, self.direction.parameters, row[3:6])
        bases = at_rest(self.wheels, self.bodies, e)
        for wheels, lanes in zip(bases.wheels, bases.lanes, strict=True):
            deflect_at_rest(wheels.reshape(-1), row, lanes)
        members = self.fitted.members
        bases = bases._replace(learnt=np.zeros((members, members + 1)))
        return SlipState(t, t, rest, 1, np.zeros(3), row, bases, none, band, none[1])


def slip_stream(model: StickSlip) -> SlipStream:
    """The base of a model, driven by a plate.

    Raises:
        NoSuchElement: It was not fitted with one.
    """
    found = model.direction("plate")
    optimum = found.parameters
    values = np.array([*values_of(found.ensemble), *[optimum.values] * PRELOADS])
    wheels, own = model.wheels.each(values), bodies(values, found.corrected)
    compliance = np.linalg.inv(model.wheels.stiffness(optimum))
    linear, off = np.asarray(found.linear, dtype=bool), model.tilting.off
    fitted = Fitted(len(found.ensemble), len(own), compliance, found.slips, linear, off)
    return SlipStream(found, model.wheels, wheels, own, fitted, model.tilting)


@njit(cache=True, error_model="numpy")
def mean_of(state: np.ndarray, row: int, members: int) -> np.ndarray:
    """(3,) of the members, from a row of their states on."""
    mean = np.zeros(3)
    for k in range(3):
        for e in range(members):
            mean[k] += state[e // LANES, row + k, e % LANES] / members
    return mean


@njit(cache=True, error_model="numpy")
def advance_members(
    bases: Bases, drive: np.ndarray, inertia: np.ndarray, h: float, members: int, k: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """`advance` for k bases: the members of an ensemble, then preloaded ones of the first member's parameters.

    Args:
        bases: States, deflections and what was learnt of the members are changed.
        drive: (steps, 13).
        inertia: (15,).
        h: [s].
        members: Of the ensemble.
        k: Of all.

    Returns:
        Mean (3,) of the members, as a plate informs it, shifted as it judges preloads, and their variance; mean square
        (3,) of the preloaded about the first; variance (3,) of the shift, 0 without a plate.
    """
    x, own, found = np.empty((k - members + 1, 3)), np.empty(k - members + 1), np.zeros((3, 3))
    each, missed, mean = np.empty((members, 3)), np.empty((members, 3)), np.empty((2, 3))
    for g in range(len(bases.lanes)):
        advance(bases.state[g], bases.wheels[g], drive, inertia, h, bases.lanes[g])
    for i in range(members):
        for a in range(3):
            each[i, a] = bases.state[i // LANES, X + a, i % LANES]
            missed[i, a] = bases.state[i // LANES, MISSED + a, i % LANES]
    learn(bases.learnt, missed, h * len(drive))
    informed(bases.learnt, each, mean)
    for o in range(len(own)):
        i = members - 1 + o if o > 0 else 0
        own[o] = bases.state[i // LANES, UNLIKELY, i % LANES]
        for a in range(3):
            x[o, a] = bases.state[i // LANES, X + a, i % LANES]
    if k > members:
        weighed(own, x, found)
    return mean[0] + found[0], mean[1], found[2], found[1]


@njit(cache=True, error_model="numpy")
def sample_row(
    wrench: np.ndarray, heave: np.ndarray, driving: np.ndarray, rest: np.ndarray, off: np.ndarray, row: np.ndarray
) -> None:
    """A sample as `advance` takes it (13,), by what rests (8,), see `SlipState`."""
    for a in range(3):
        row[a] = driving[a] - rest[3 + a]
    row[3], row[4], row[5] = -wrench[2], wrench[4] + wrench[2] * off[0], -wrench[3] + wrench[2] * off[1]
    row[6], row[7] = heave[0, 1] + rest[6], heave[0, 2] + rest[7]
    row[8], row[9], row[10] = wrench[0] - rest[0], wrench[1] - rest[1], wrench[5] - rest[2]
    row[TILTS], row[TILTS + 1] = heave[1, 1], heave[1, 2]


@njit(cache=True, error_model="numpy")
def step_members(
    bases: Bases,
    readings: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    fitted: Fitted,
    band: np.ndarray,
    h: float,
    row: np.ndarray,
    found: np.ndarray,
) -> None:
    """`advance_members` from one sample to the next, and `banded`; in between, readings are linear.

    Args:
        bases: States and deflections are changed.
        readings: Wrench, heave, driving (9,) and rest of `sample_row`; `row` and `found` of the sample before.
        fitted: Members, bases and K_0^-1.
        band: (4, 3) of `banded`.
        h: [s].
        row: (13,) of this sample, filled.
        found: (5, 3) of `banded`, filled.
    """
    wrench, heave, driving, rest, earlier, before = readings
    drive, inertia, elastic = np.empty((STEPS, COLUMNS)), np.zeros(15), np.zeros(3)
    sample_row(wrench, heave, driving, rest, fitted.off, row)
    for s in range(STEPS):
        for c in range(COLUMNS):
            drive[s, c] = earlier[c] + (s + 1.0) / STEPS * (row[c] - earlier[c])
    for i in range(6):
        inertia[i] = driving[3 + i]
    for i in range(3):
        for c in range(3):
            elastic[i] += fitted.compliance[i, c] * row[PLATE + c]
    banded(advance_members(bases, drive, inertia, h, fitted.members, fitted.k), before, band, elastic, heave[0], found)
