"""The stick-slip base sample by sample: each member of the ensemble is carried from one sample to the next.

    state_e(t + dt) = advance(state_e(t), sample),     x = mean_e x_e,    V as in `band`

The first second is the rest the forces count from. Between two samples they are linear; nothing after a sample is
used. Without the wrench of inverse dynamics, which needs accelerations, the base has no inertia, and the plate alone
moves it.
"""

from dataclasses import dataclass, replace

import numpy as np

from calibration.recording.trial import REST
from calibration.stages.stick_slip.forcing import STEPS, UNMOVED
from calibration.stages.stick_slip.kernel import COLUMNS, PLATE, STATE, advance_members, banded
from calibration.stages.stick_slip.likelihood import body
from calibration.stages.stick_slip.model import Direction, StickSlip
from calibration.stages.stick_slip.wheels import PRELOADS, SlipParameters, WheelSet, preloads

_PARTS = (np.arange(STEPS)[:, None] + 1.0) / STEPS
_LOADS = np.array([0.0] * 3 + [1.0] * 3 + [0.0] * 5)  # of a sample at rest: the vertical load alone


@dataclass(frozen=True)
class Sample:
    """One sample.

    Attributes:
        t: [s].
        wrench: (6,) action on the floor in frame 0, by the plate [N, N.m].
        tilt: (2,) rx, ry since the first second [rad], as the compliance has them.
        driving: (3,) Fx, Fy, Mz of inverse dynamics, tilt's inertia taken off; None without.
        inertia: (6,) of M in the plane, row by row, upper; None without.
    """

    t: float
    wrench: np.ndarray
    tilt: np.ndarray
    driving: np.ndarray | None = None
    inertia: np.ndarray | None = None


@dataclass(frozen=True)
class SlipState:
    """The base after a sample.

    Attributes:
        start: Time of the first sample [s].
        t: Of the last one.
        rest: (6,) mean of the plate's (Fx, Fy, Mz) and of those of inverse dynamics in the first second.
        n: Samples in that mean.
        before: (11,) the last sample as the kernel takes it.
        states: (e, STATE) of the members, then of the preloaded optimum.
        deflections: (e, m, 2).
        found: (6, 3) see `kernel.banded`.
        x: (3,) x, y, yaw [m, rad, frame 0].
    """

    start: float
    t: float
    rest: np.ndarray
    n: int
    before: np.ndarray
    states: np.ndarray
    deflections: np.ndarray
    found: np.ndarray
    x: np.ndarray

    def variance(self, of: Direction) -> np.ndarray:
        """(3,) of x, or of what the compliance makes of it."""
        return np.where(of.slips, self.found[4], of.plain.variance(self.found[5]))


@dataclass(frozen=True)
class SlipStream:
    """A fitted base made ready for samples.

    Attributes:
        direction: What was fitted with a plate.
        wheel_set: Of the robot.
        wheels: (e, m, 10) of the members, then of the optimum, once for each preload.
        bodies: (e, 5): as the kernel takes them, and whether it is a member.
        compliance: (3, 3) K_0^-1 of the optimum.
        moves: (3,) axes that are moved; linear ones are the compliance's, see `loaded_base`.
        band: (4, 3) s, r, p, l.
    """

    direction: Direction
    wheel_set: WheelSet
    wheels: np.ndarray
    bodies: np.ndarray
    compliance: np.ndarray
    moves: np.ndarray
    band: np.ndarray

    def stepped(self, sample: Sample, before: SlipState | None) -> SlipState:
        """The base one sample on; without a state before, this sample is the first at rest."""
        row, planar = _row(sample)
        if before is None:
            return self._first(sample.t, row, planar)
        if sample.t <= before.start + REST:
            n = before.n + 1
            still = row * _LOADS
            return replace(before, t=sample.t, rest=before.rest + (planar - before.rest) / n, n=n, before=still)
        row[PLATE:] -= before.rest[:3]
        row[:3] -= before.rest[3:]
        states, e = before.states.copy(), before.deflections.copy()
        h = (sample.t - before.t) / STEPS
        drive = before.before + _PARTS * (row - before.before)
        arguments = states, e, drive, _inertia(sample), self.wheels, self.bodies, h
        mean, spread, preloaded, share = advance_members(*arguments)
        elastic = self.compliance @ row[PLATE:]
        found = banded(mean, before.found, share, self.band, spread, preloaded, elastic)
        return SlipState(before.start, sample.t, before.rest, before.n, row, states, e, found, found[3] * self.moves)

    def _first(self, t: float, row: np.ndarray, planar: np.ndarray) -> SlipState:
        none = np.zeros((6, 3))
        none[4] = self.band[0] ** 2
        states, e = np.zeros((len(self.wheels), STATE)), np.zeros((*self.wheels.shape[:2], 2))
        e[len(self.direction.ensemble) :] = preloads(self.wheel_set, self.direction.parameters, row[3:6])
        return SlipState(t, t, planar, 1, row * _LOADS, states, e, none, none[3])


def slip_stream(model: StickSlip) -> SlipStream:
    """The base of a model, driven by a plate.

    Raises:
        NoSuchElement: It was not fitted with one.
    """
    found = model.direction("plate")
    optimum = found.parameters
    parameters = [*(SlipParameters.of(own) for own in found.ensemble), *[optimum] * PRELOADS]
    wheels = np.array([model.wheels.rows(p) for p in parameters])
    members = np.arange(len(parameters)) < len(found.ensemble)
    bodies = np.column_stack([[body(p, True) for p in parameters], members])
    compliance = np.linalg.inv(model.wheels.stiffness(optimum))
    return SlipStream(
        found,
        model.wheels,
        wheels,
        bodies,
        compliance,
        found.slips,
        np.array([found.band.floor, found.band.spread, found.band.start, found.band.slip]),
    )


def _row(sample: Sample) -> tuple[np.ndarray, np.ndarray]:
    """The sample as the kernel takes it (11,), and its forces in the plane (6,): the plate's, inverse dynamics'."""
    row = np.zeros(COLUMNS)
    row[3:6] = -sample.wrench[2], sample.wrench[4], -sample.wrench[3]
    row[6:8], row[PLATE:] = sample.tilt, sample.wrench[[0, 1, 5]]
    if sample.driving is not None:
        row[:3] = sample.driving
    return row, np.concatenate([row[PLATE:], row[:3]])


def _inertia(sample: Sample) -> np.ndarray:
    """(15,) as the kernel takes it."""
    found = np.zeros(15)
    found[[0, 3, 5]] = UNMOVED
    if sample.inertia is not None:
        found[:6] = sample.inertia
    return found
