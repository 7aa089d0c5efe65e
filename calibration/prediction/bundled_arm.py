"""The arm of row `full` in use: motor readings in; link angles, their variances and the column's moment out.

    T_B_H = Q(M) T_B_H(q_link)         q_link as `drive_trains` has it, M moment on the column, Q its bending

    covariance of the hand's twist by what the arm adds:
        J_joint diag(V + (sigma_c tau)^2) J_joint' + J_column diag((sigma_b M)^2) J_column'

V that of `LinkAngles` and the readings' random error, as the hand's markers showed it beside that; of a joint at rest
at least what link encoders showed in dwells. sigma_c, sigma_b are the standard
deviations of the meshes' and the column's compliance.

Where its pose is known, the base loads drive trains as it leans, turns and accelerates. Readings of which no motion
is known are each taken to be at rest: the load decides the side of a mesh, else the link is anywhere in what friction
holds.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from calibration.numerics.compiled import njit
from calibration.numerics.lie import adjoint, inverse
from calibration.robot.hand import HandModel
from calibration.robot.wrist_sensor import Push
from calibration.stages.drive_trains.column_bending import ColumnBending, moved
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.drive_trains.kernel.link_streams import RESTS
from calibration.stages.drive_trains.streams import Stream, StreamState, stream_of
from calibration.stages.drive_trains.torques import LinkLoads
from calibration.stages.suspension.floor_wrench import root_in_base

_AT_REST = np.zeros((3, 3))


class ArmPositions(NamedTuple):
    """What the geometry is evaluated at.

    Attributes:
        q: (n, k) link angles, zeros of the readings included [rad, m].
        variance: (n, k) of them [rad2]; 0 of joints without a drive train.
        moment: (n, 2) on the column [N.m].
        torque: (n, k) on the joints [N.m, N].
        velocity: (n, k) of the joints [rad/s, m/s].
    """

    q: np.ndarray
    variance: np.ndarray
    moment: np.ndarray
    torque: np.ndarray
    velocity: np.ndarray


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
        rest_sigma: (k,) standard deviation of each joint's angle in dwells [rad]; 0 where not known.
    """

    trains: DriveTrains
    bending: ColumnBending
    rest_sigma: np.ndarray

    def along(
        self,
        t: np.ndarray,
        q_motor: np.ndarray,
        velocity: np.ndarray | None = None,
        T_lab_base: np.ndarray | None = None,
        wrist: np.ndarray | None = None,
        by_plate: bool = False,
    ) -> ArmPositions:
        """Of readings q_motor (n, k) [rad, m] at t (n,) [s].

        Velocity (n, k), the base (n, 4, 4), by a plate's wrench or not, and the wrist's sensor (n, 6) where known.

        Raises:
            NotEnoughData: Less than a second of readings and no velocity.
        """
        robot = self.trains.dynamics
        base = None if T_lab_base is None else self.trains.base_motion(t, T_lab_base, t, by_plate)

        def under(push: Push | None, delta: np.ndarray | None) -> LinkLoads:
            if velocity is None:
                return robot.loads("", t, q_motor, base, push, delta)
            a = np.gradient(velocity, t, axis=0) if len(t) > 1 else np.zeros_like(velocity)
            found = robot.evaluated(q_motor, velocity, a, base, push, delta)
            return LinkLoads("", t, q_motor, q_motor - robot.offset, velocity, a, *found)

        loads = self.trains.weighed(t, q_motor, wrist, under)
        angles = self.trains.of_loads(loads)
        return ArmPositions(angles.q, angles.variance, angles.moment, loads.torque, loads.v)

    def at_rest(self, q_motor: np.ndarray, T_lab_base: np.ndarray | None = None) -> ArmPositions:
        """Of readings (n, k) at rest, each for itself; the base (4, 4) where it is known.

        A link trails its motor and stops on a flank: its variance is that of the two ends, not of what is between.
        """
        still, base = np.zeros(q_motor.shape[1]), self.root(T_lab_base)
        states, angles = zip(
            *(self._stream.begin(0.0, np.array([q, still, still]), base) for q in q_motor), strict=True
        )
        q, low, high = (np.concatenate([getattr(f, name) for f in angles]) for name in ("q", "low", "high"))
        residual = {train.joint: train.residual for train in self.trains.trains}
        left_out = np.array([residual.get(joint, 0.0) for joint in self.trains.joints])
        variance = 0.25 * (high - low) ** 2 + left_out**2
        moment, torque = (np.concatenate([getattr(s, name) for s in states]) for name in ("moment", "torque"))
        return ArmPositions(q, variance, moment, torque, np.zeros(q.shape))

    def moving(self, t: float, q_motor: np.ndarray, velocity: np.ndarray | None, before: ArmState | None) -> np.ndarray:
        """(3, k) readings, velocities and accelerations of one sample, differences of the velocities.

        Without a velocity it is at rest.
        """
        found = np.zeros((3, len(q_motor)))
        found[0] = q_motor
        if velocity is not None:
            found[1] = velocity
            if before is not None:
                found[2] = (velocity - before.drives.moving[1]) / (t - before.drives.t)
        return found

    def stepped(
        self, t: float, moving: np.ndarray, before: ArmState | None, base: np.ndarray | None = None
    ) -> ArmState:
        """One sample on, `moving` (3, k) as of `moving`, `base` (1, 12) as of `root`."""
        if before is None:
            drives, angles = self._stream.begin(t, moving, base)
        else:
            drives, angles = self._stream.step(before.drives, t, moving, base)
        return ArmState(drives, ArmPositions(angles.q, angles.variance, drives.moment, drives.torque, moving[1:2]))

    def root(self, T_lab_base: np.ndarray | None, moves: np.ndarray | None = None) -> np.ndarray | None:
        """The root (1, 12) as `Dynamics.root` has it, the base frame at T_lab_base (4, 4); None if that is not known.

        `moves` (3, 3): how the base frame accelerates, linear and angular, and turns [m/s2, rad/s2, rad/s, lab axes];
        at rest where not given.
        """
        if T_lab_base is None:
            return None
        a = _AT_REST if moves is None else moves
        return np.asarray(moving_root(T_lab_base, self._T_base_root, self.trains.dynamics.gravity, a))

    def bends(self, hand: HandModel, positions: ArmPositions) -> np.ndarray:
        """Q (n, 4, 4) in the base's marker body."""
        return moved(hand, self.bending, positions.q, positions.moment)

    def poses(self, hand: HandModel, positions: ArmPositions) -> np.ndarray:
        """T_B_H (n, 4, 4), the column bent."""
        return hand.poses(positions.q, self.bending.turns(positions.moment))

    def variance(self, hand: HandModel, positions: ArmPositions, reading_sigma: np.ndarray) -> np.ndarray:
        """(n, m) of the chain's joints: random error of the reading where there is no drive train.

        What parameters of a drive train err by, what it leaves of trials left out says; beyond their loads its
        compliance's standard deviation.
        """
        rests = np.abs(positions.velocity) < RESTS
        own = np.maximum(positions.variance, np.where(rests, self.rest_sigma**2, 0.0))
        found = np.zeros(own.shape)
        for train in self.trains.trains:
            j = self.trains.joints.index(train.joint)
            known = {q.name: q.sigma for q in train.parameters if train.form == "dead_zone" and np.isfinite(q.sigma)}
            sigma = known.get(f"gear.{train.joint}.compliance", 0.0)
            found[:, j] = own[:, j] + (sigma * train.beyond(positions.torque[:, j])) ** 2
        return np.asarray(found[:, hand.chain.columns] + reading_sigma**2)

    def column_covariance(self, hand: HandModel, positions: ArmPositions, T_base_hand: np.ndarray) -> np.ndarray:
        """(n, 6, 6) of the local twist of the hand at T_base_hand (n, 4, 4), by the column's compliance."""
        sigma = np.where(np.isfinite(self.bending.sigma), self.bending.sigma, 0.0)
        T_base_column = hand.chain.poses(hand.angles(positions.q), self.bending.joint)
        J = adjoint(inverse(T_base_hand) @ T_base_column)[:, :, 3:5]
        moment = positions.moment - self.bending.mean
        return np.asarray(J * (sigma * moment)[:, None, :] ** 2 @ np.swapaxes(J, 1, 2))

    @cached_property
    def _T_base_root(self) -> np.ndarray:
        return np.asarray(root_in_base(self.trains.dynamics.model, self.trains.description).homogeneous)

    @cached_property
    def _stream(self) -> Stream:
        return stream_of(self.trains)


@njit(cache=True, error_model="numpy")
def moving_root(T_lab_base: np.ndarray, T_base_root: np.ndarray, gravity: np.ndarray, a: np.ndarray) -> np.ndarray:
    """0, R' omega, R' (a_base + alpha x p - gravity) and R' alpha of the root, p its place beside the base [m]."""
    push, R, p, found = np.empty(3), np.zeros((3, 3)), np.zeros(3), np.zeros((1, 12))
    for i in range(3):
        for k in range(3):
            p[i] += T_lab_base[i, k] * T_base_root[k, 3]
            for c in range(3):
                R[i, c] += T_lab_base[i, k] * T_base_root[k, c]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        push[i] = a[0, i] + a[1, j] * p[k] - a[1, k] * p[j] - gravity[i]
    for c in range(3):
        for i in range(3):
            found[0, 3 + c] += R[i, c] * a[2, i]
            found[0, 6 + c] += R[i, c] * push[i]
            found[0, 9 + c] += R[i, c] * a[1, i]
    return found
