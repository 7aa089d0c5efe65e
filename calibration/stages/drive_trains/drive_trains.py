"""The drive trains of a robot in use: motor readings in, link angles and their intervals out.

    q_link = q_motor - offset - e_m - delta           what the geometry is asked with:  q_motor - e_m - delta

The geometry keeps the zeros of the readings. One that was fitted to bare readings holds the mean delta of its postures
in them: `zero` is to be added for it, and not for one that was fitted to corrected readings (`geometry_refit`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.errors import NoSuchElement, ShapeError
from calibration.recording.schema import Description
from calibration.robot.floating_base import floating_model
from calibration.stages.drive_trains.drive_train import DriveTrain, Quantity, drive_motion
from calibration.stages.drive_trains.torques import Dynamics, LinkLoads

_SURE = 0.5  # share of the half gap
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
