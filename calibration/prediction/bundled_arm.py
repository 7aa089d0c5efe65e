"""The arm of row `full` in use: motor readings in; link angles, their variances and the column's moment out.

    T_B_H = Q(M) T_B_H(q_link)         q_link as `drive_trains` has it, M moment on the column, Q its bending

    covariance of the hand's twist by what the arm adds:
        J_joint diag(V + (sigma_c tau)^2) J_joint' + J_column diag((sigma_b M)^2) J_column'

V that of `LinkAngles`, with the readings' random error as the hand's markers showed it where that is more than what
link encoders showed; of a joint at rest at least what they showed in dwells. sigma_c, sigma_b are the standard
deviations of the meshes' and the column's compliance.

The base is taken to be level and at rest. Readings of which no motion is known are each taken to be at rest: the load
decides the side of a mesh, else the link is anywhere in what friction holds.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from calibration.numerics.lie import adjoint, inverse
from calibration.robot.hand import HandModel
from calibration.stages.drive_trains.column_bending import ColumnBending, moved
from calibration.stages.drive_trains.drive_trains import DriveTrains, Stream, StreamState, stream_of
from calibration.stages.drive_trains.torques import LinkLoads

_RESTS = 5e-3  # [rad/s, m/s] below which a joint is at rest


class ArmPositions(NamedTuple):
    """What the geometry is evaluated at.

    Attributes:
        q: (n, k) link angles, zeros of the readings included [rad, m].
        variance: (n, k) of them [rad2]; 0 of joints without a drive train.
        moment: (n, 2) on the column [N.m].
        torque: (n, k) on the joints [N.m, N].
        rests: (n, k) whether a joint is at rest.
    """

    q: np.ndarray
    variance: np.ndarray
    moment: np.ndarray
    torque: np.ndarray
    rests: np.ndarray


class ArmState(NamedTuple):
    """Drive trains after a sample.

    Attributes:
        drives: State of the drive trains.
        positions: Of the sample, n = 1.
    """

    drives: StreamState
    positions: ArmPositions


@dataclass(frozen=True)
class BundledArm:
    """Drive trains and the column they turn on.

    Attributes:
        trains: With the payload in the hand.
        bending: Of the column.
        rest_sigma: (k,) rms error of each joint's angle in dwells [rad]; 0 where not known.
    """

    trains: DriveTrains
    bending: ColumnBending
    rest_sigma: np.ndarray

    def along(self, t: np.ndarray, q_motor: np.ndarray, velocity: np.ndarray | None = None) -> ArmPositions:
        """Of readings q_motor (n, k) [rad, m] at t (n,) [s]; velocity (n, k) where it is known.

        Raises:
            NotEnoughData: Less than a second of readings and no velocity.
        """
        robot = self.trains.dynamics
        if velocity is None:
            loads = robot.loads("", t, q_motor, None, regressors=True)
        else:
            a = np.gradient(velocity, t, axis=0) if len(t) > 1 else np.zeros_like(velocity)
            found = robot.evaluated(q_motor, velocity, a, None, True)
            loads = LinkLoads("", t, q_motor, q_motor - robot.offset, velocity, a, *found)
        angles = self.trains.of_loads(loads)
        return ArmPositions(angles.q, angles.variance, loads.moment, loads.torque, np.abs(loads.v) < _RESTS)

    def at_rest(self, q_motor: np.ndarray) -> ArmPositions:
        """Of readings (n, k) at rest, each for itself."""
        still = np.zeros(q_motor.shape[1])
        states, angles = zip(*(self._stream.begin(0.0, q, still, still) for q in q_motor), strict=True)
        q, variance = (np.concatenate([getattr(f, name) for f in angles]) for name in ("q", "variance"))
        moment, torque = (np.concatenate([getattr(s, name) for s in states]) for name in ("moment", "torque"))
        return ArmPositions(q, variance, moment, torque, np.ones(q.shape, dtype=bool))

    def stepped(self, t: float, q_motor: np.ndarray, velocity: np.ndarray | None, before: ArmState | None) -> ArmState:
        """One sample q_motor (k,) on; accelerations are differences of the velocities (k,).

        Without a velocity the torques are those of rest, and the meshes follow the readings.
        """
        v, a = np.zeros_like(q_motor) if velocity is None else velocity, np.zeros_like(q_motor)
        if before is None:
            drives, angles = self._stream.begin(t, q_motor, v, a)
        else:
            if velocity is not None:
                a = (v - before.drives.moving[1]) / (t - before.drives.t)
            drives, angles = self._stream.step(before.drives, t, q_motor, v, a)
        rests = np.abs(v[None]) < _RESTS
        return ArmState(drives, ArmPositions(angles.q, angles.variance, drives.moment, drives.torque, rests))

    def bends(self, hand: HandModel, positions: ArmPositions) -> np.ndarray:
        """Q (n, 4, 4) in the base's marker body."""
        return moved(hand, self.bending, positions.q, positions.moment)

    def poses(self, hand: HandModel, positions: ArmPositions) -> np.ndarray:
        """T_B_H (n, 4, 4), the column bent."""
        return hand.poses(positions.q, self.bending.turns(positions.moment))

    def variance(self, hand: HandModel, positions: ArmPositions, reading_sigma: np.ndarray) -> np.ndarray:
        """(n, m) of the chain's joints: random error of the reading where there is no drive train."""
        known = {q.name: q.sigma for train in self.trains.trains for q in train.parameters if np.isfinite(q.sigma)}
        sigma = np.array([known.get(f"gear.{joint}.compliance", 0.0) for joint in hand.chain.joints])
        residual = {train.joint: train.residual for train in self.trains.trains}
        driven = np.isin(hand.chain.joints, list(residual))
        unseen = reading_sigma**2 - np.array([residual.get(joint, 0.0) for joint in hand.chain.joints]) ** 2
        own, torque, rests = (x[:, hand.chain.columns] for x in (positions.variance, positions.torque, positions.rests))
        own = np.maximum(own, np.where(rests, self.rest_sigma[hand.chain.columns] ** 2, 0.0))
        return np.where(driven, own + np.maximum(unseen, 0.0) + (sigma * torque) ** 2, reading_sigma**2)

    def column_covariance(self, hand: HandModel, positions: ArmPositions, T_base_hand: np.ndarray) -> np.ndarray:
        """(n, 6, 6) of the local twist of the hand at T_base_hand (n, 4, 4), by the column's compliance."""
        sigma = np.where(np.isfinite(self.bending.sigma), self.bending.sigma, 0.0)
        T_base_column = hand.chain.poses(hand.angles(positions.q), self.bending.joint)
        J = adjoint(inverse(T_base_hand) @ T_base_column)[:, :, 3:5]
        return np.asarray(J * (sigma * positions.moment)[:, None, :] ** 2 @ np.swapaxes(J, 1, 2))

    @cached_property
    def _stream(self) -> Stream:
        return stream_of(self.trains)
