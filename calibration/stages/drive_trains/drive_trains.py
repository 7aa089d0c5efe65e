"""The drive trains of a robot in use: motor readings in, link angles and their intervals out.

    q_link = q_motor - offset - e_m - delta           what the geometry is asked with:  q_motor - e_m - delta

The geometry keeps the zeros of the readings. One that was fitted to bare readings holds the mean delta of its postures
in them: `zero` is to be added for it, and not for one that was fitted to corrected readings (`geometry_refit`).

Drive trains sample by sample: the state is passed from one to the next, nothing after a sample is read.

    state, angles = stream.step(state, t, q_motor, velocity, acceleration)

Velocities and accelerations are the caller's; with those that `torques.derivatives` has of a recording, the angles are
those of the recording in one go.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from calibration.errors import NoSuchElement, ShapeError
from calibration.recording.schema import Description
from calibration.robot.floating_base import floating_model
from calibration.stages.drive_trains import link_motion
from calibration.stages.drive_trains.drive_train import (
    LIGHT,
    LONGEST,
    DriveTrain,
    Quantity,
    drive_motion,
    harmonic_terms,
)
from calibration.stages.drive_trains.link_motion import COMPLIANCE
from calibration.stages.drive_trains.torques import Dynamics, LinkLoads, inertials, regressor_columns

_SURE = 0.5  # share of the half gap
_RUNS = 5  # likely; torque off by -2 and by 2 standard deviations, from either end of what friction holds
_WOUND = 3e-4  # [rad] an interval as narrow as this is of one side, however small the gap


@dataclass(frozen=True)
class LinkAngles:
    """Joint angles behind motor readings, zeros of the readings included, all (n, k).

    Attributes:
        q: Motor readings less eccentricity and delta [rad, m].
        low: Least of them, where the side of the mesh is not known.
        high: Largest.
        determined: Whether the side is known; true of joints without a drive train.
        variance: Of q [rad2].
    """

    q: np.ndarray
    low: np.ndarray
    high: np.ndarray
    determined: np.ndarray
    variance: np.ndarray


@dataclass(frozen=True)
class DriveTrains:
    """Drive trains of a robot and the dynamics that load them.

    Attributes:
        dynamics: From motion to torque, with the declared payload.
        trains: In the order of the measured joints; some joints have none.
        zero: (k,) mean delta over the static calibration postures [rad, m]; 0 without a drive train.
        urdf: Text the dynamics were built from.
        description: Of the dataset.
    """

    dynamics: Dynamics
    trains: tuple[DriveTrain, ...]
    zero: np.ndarray
    urdf: str
    description: Description

    @property
    def joints(self) -> tuple[str, ...]:
        """The measured joints: columns of every q."""
        return self.dynamics.joints

    @property
    def parameters(self) -> tuple[Quantity, ...]:
        """Of all joints."""
        return tuple(q for train in self.trains for q in train.parameters)

    def by_joint(self, of_trains: np.ndarray) -> np.ndarray:
        """(k,) of all joints from values (m,) of the drive trains; 0 of joints without one."""
        found = np.zeros(len(self.joints))
        found[[self.joints.index(train.joint) for train in self.trains]] = of_trains
        return found

    def train(self, joint: str) -> DriveTrain:
        """The drive train of a joint.

        Raises:
            NoSuchElement: It has none.
        """
        found = next((train for train in self.trains if train.joint == joint), None)
        if found is None:
            raise NoSuchElement("drive train", joint, [train.joint for train in self.trains])
        return found

    def of_trial(self, trial_id: str) -> "DriveTrains":
        """The same with the payload of one trial of the dataset; of another trial, the campaign's."""
        entry = next((t for t in self.description.trials if t.id == trial_id), None)
        return self if entry is None else self.carrying(entry.payload)

    def carrying(self, mass: float | None) -> "DriveTrains":
        """The same with another mass [kg] of the declared payload."""
        loaded = self.description.carrying(mass)
        if loaded is self.description:
            return self
        model = floating_model(self.urdf, loaded)
        model.gravity = self.dynamics.model.gravity
        return replace(self, dynamics=replace(self.dynamics, model=model))

    def with_offset(self, offset: np.ndarray) -> "DriveTrains":
        """The same with other zeros (k,) of the motor readings."""
        return replace(self, dynamics=replace(self.dynamics, offset=offset))

    def link_angles(
        self, t: np.ndarray, q_motor: np.ndarray, base: np.ndarray | None = None, start: np.ndarray | None = None
    ) -> LinkAngles:
        """Link angles at readings q_motor (n, k) [rad, m] taken at t (n,) [s], any clock, without NaN.

        Args:
            t: Times, increasing; a second of them at least.
            q_motor: Readings.
            base: (n, 6) proper acceleration of the base, `torques.base_acceleration`; level and at rest if not given.
            start: (k,) delta at the first reading [rad], where it is known.

        Raises:
            NotEnoughData: Less than a second of readings.
        """
        if q_motor.shape != (len(t), len(self.joints)):
            raise ShapeError("q_motor", q_motor.shape, (len(t), len(self.joints)))
        return self.of_loads(self.dynamics.loads("", t, q_motor, base, regressors=True), start)

    def of_loads(self, loads: LinkLoads, start: np.ndarray | None = None) -> LinkAngles:
        """Link angles of a trial whose loads are known, with regressors."""
        q = loads.q.astype(float).copy()
        low, high, sure, variance = q.copy(), q.copy(), np.ones(q.shape, dtype=bool), np.zeros(q.shape)
        for train in self.trains:
            j = self.joints.index(train.joint)
            inertials = train.inertials if len(train.inertials) else None
            known = None if start is None else start[[j]]
            delta = train.backlash(drive_motion([loads], j, inertials), known)
            bare = loads.q[:, j] - train.harmonics(loads.angle[:, j])
            q[:, j], low[:, j], high[:, j] = bare - delta.value, bare - delta.high, bare - delta.low
            sure[:, j] = delta.high - delta.low < one_side(train)
            variance[:, j] = (delta.high - delta.low) ** 2 / 12.0 + train.residual**2
        return LinkAngles(q, low, high, sure, variance)


def one_side(train: DriveTrain) -> float:
    """Width of an interval [rad] below which the side of the mesh is known."""
    return max(_SURE * float(train.values[0]), _WOUND)


def zeros_of(trains: DriveTrains, deltas: Sequence[np.ndarray]) -> np.ndarray:
    """Mean (k,) of delta over dwells, each (k,)."""
    return np.mean(deltas, axis=0) if len(deltas) else np.zeros(len(trains.joints))


@dataclass(frozen=True)
class StreamState:
    """Where m drive trains are.

    Attributes:
        t: [s].
        q: (m,) motor readings [rad].
        v: (m,) motor velocities [rad/s].
        torque: (m,) [N.m].
        inertia: (m,) [kg.m2].
        states: (m, 5, 3) delta, its rate and the slider of each run.
    """

    t: float
    q: np.ndarray
    v: np.ndarray
    torque: np.ndarray
    inertia: np.ndarray
    states: np.ndarray


@dataclass(frozen=True)
class Stream:
    """Drive trains made ready for single samples, see `stream_of`; all of m drive trains.

    Attributes:
        trains: The drive trains.
        columns: (m,) column of each in the readings.
        values: (m, 7) as simulated.
        inertials: (m, p) of each load.
        link_inertia: (m,) [kg.m2].
        offs: (m, 5) error of the torque in each run [N.m].
        shifts: (m, 5) that it winds a mesh up by [rad].
        motor: (m, 4) eccentricities [rad].
        dynamic: (m,) whose links' inertia counts.
        played: (m,) which are play operators.
        one_side: (m,) width of an interval below which the side is known [rad].
        residual: (m,) variance that trials left out kept [rad2].
        eccentric: Whether any motor encoder is.
        data: Scratch of the dynamics.
        velocities: (k,) index of each measured joint's velocity.
        wanted: Columns of the torque regressor.
    """

    trains: DriveTrains
    columns: np.ndarray
    values: np.ndarray
    inertials: np.ndarray
    link_inertia: np.ndarray
    offs: np.ndarray
    shifts: np.ndarray
    motor: np.ndarray
    dynamic: np.ndarray
    played: np.ndarray
    one_side: np.ndarray
    residual: np.ndarray
    eccentric: bool
    data: pin.Data
    velocities: np.ndarray
    wanted: np.ndarray

    def begin(
        self, t: float, q: np.ndarray, v: np.ndarray, a: np.ndarray, base: np.ndarray | None = None
    ) -> tuple[StreamState, LinkAngles]:
        """The state at a first sample q, v, a (k,) of an unknown history, and its link angles (1, k)."""
        torque, inertia = self._loads(q, v, a, base)
        states = np.zeros((len(self.columns), _RUNS, 3))
        for i, train in enumerate(self.trains.trains):
            low, high = train.at_rest(float(torque[i]))
            starts = [low + train.start[0] * (high - low)]
            for off in self.offs[i, 1::2]:
                starts += train.at_rest(float(torque[i] + off))
            states[i, :, 0] = states[i, :, 2] = starts
        state = StreamState(t, q[self.columns], v[self.columns], torque, inertia, states)
        return state, self._angles(state, q)

    def step(
        self, before: StreamState, t: float, q: np.ndarray, v: np.ndarray, a: np.ndarray, base: np.ndarray | None = None
    ) -> tuple[StreamState, LinkAngles]:
        """The state one sample q, v, a (k,) later and its link angles (1, k); base (6,) as `link_angles` has it."""
        torque, inertia = self._loads(q, v, a, base)
        states, m = before.states.copy(), len(self.columns)
        state = StreamState(t, q[self.columns], v[self.columns], torque, inertia, states)
        earlier, now = (link_motion.Drive(np.full(m, s.t), s.q, s.v, s.torque, s.inertia) for s in (before, state))
        link_motion.stream(states, earlier, now, self.offs, LONGEST, self.values, self.played)
        return state, self._angles(state, q)

    def _loads(
        self, q: np.ndarray, v: np.ndarray, a: np.ndarray, base: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Torque and inertia (m,) of each drive train."""
        robot, c = self.trains.dynamics, self.columns
        torque, inertia, R, _ = robot.at(self.data, self.velocities, self.wanted, q, v, a, base)
        own = torque[c] + (R[c] * self.inertials).sum(axis=1) + self.link_inertia * a[c]
        return own, np.where(self.dynamic, np.maximum(inertia[c] + self.link_inertia, LIGHT), LIGHT)

    def _angles(self, state: StreamState, q: np.ndarray) -> LinkAngles:
        delta, c = state.states[:, :, 0] - self.shifts, self.columns
        top, bottom = delta.max(axis=1), delta.min(axis=1)
        bare = state.q
        if self.eccentric:
            bare = bare - (harmonic_terms(state.q - self.trains.dynamics.offset[c]) * self.motor).sum(axis=1)
        found, sure, variance = np.empty((3, 1, len(q))), np.ones((1, len(q)), dtype=bool), np.zeros((1, len(q)))
        found[:, 0] = q
        found[0, 0, c], found[1, 0, c], found[2, 0, c] = bare - delta[:, 0], bare - top, bare - bottom
        sure[0, c], variance[0, c] = top - bottom < self.one_side, (top - bottom) ** 2 / 12.0 + self.residual
        return LinkAngles(found[0], found[1], found[2], sure, variance)


def stream_of(trains: DriveTrains) -> Stream:
    """Drive trains made ready for single samples."""
    of, robot = trains.trains, trains.dynamics
    p = len(inertials(robot))
    offs = np.array([[0.0, -s, -s, s, s] for s in (2.0 * t.torque_sigma for t in of)]).reshape(-1, _RUNS)
    return Stream(
        trains,
        np.array([trains.joints.index(t.joint) for t in of], dtype=int),
        np.array([t.simulated_values for t in of]).reshape(-1, 7),
        np.array([t.inertials if len(t.inertials) else np.zeros(p) for t in of]).reshape(-1, p),
        np.array([t.link_inertia for t in of]),
        offs,
        offs * np.array([t.values[COMPLIANCE] for t in of])[:, None],
        np.array([t.motor for t in of]).reshape(-1, 4),
        np.array([t.dynamic for t in of], dtype=bool),
        np.array([not t.dynamic and t.form == "dead_zone" for t in of], dtype=bool),
        np.array([one_side(t) for t in of]),
        np.array([t.residual**2 for t in of]),
        any(t.motor.any() for t in of),
        robot.model.createData(),
        robot.columns,
        regressor_columns(robot.model),
    )
