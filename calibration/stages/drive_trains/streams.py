"""Drive trains sample by sample: the state is passed from one to the next, nothing after a sample is read.

    state, angles = stream.step(state, t, [q_motor, velocity, acceleration])

With the velocities and accelerations that `torques.derivatives` has of a recording, the angles are those in one go.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from calibration.robot.rigid_tree import scratch
from calibration.robot.tree_dynamics import TreeDynamics, room
from calibration.stages.drive_trains.drive_train import LONGEST
from calibration.stages.drive_trains.drive_trains import DriveTrains, LinkAngles, begun, prepared
from calibration.stages.drive_trains.kernel import link_streams
from calibration.stages.drive_trains.kernel.link_streams import TORQUE, Drives, Unnamed


class StreamState(NamedTuple):
    """Where m drive trains are.

    Attributes:
        t: [s].
        moving: (3, k) readings, velocities and accelerations of all motors [rad, m, s].
        samples: (4, m) motor readings [rad], velocities [rad/s], torques [N.m] and inertias [kg.m2].
        states: (m, 5, 3) delta, its rate and the slider of each run; then how a column that bends leans.
        torque: (1, k) nominal, on all joints [N.m, N].
        moment: (1, 2) on the column, as of `LinkAngles` [N.m].
    """

    t: float
    moving: np.ndarray
    samples: np.ndarray
    states: np.ndarray
    torque: np.ndarray
    moment: np.ndarray


@dataclass(frozen=True)
class Stream:
    """Drive trains made ready for single samples, see `stream_of`.

    Attributes:
        trains: The drive trains, m of them.
        prepared: Their parameters.
        at_rest: (1, 12) twist and proper acceleration of a base that is level and at rest.
        work: Scratch of the dynamics.
        found: Room for the dynamics.
    """

    trains: DriveTrains
    prepared: Drives
    at_rest: np.ndarray
    work: np.ndarray
    found: TreeDynamics

    def begin(self, t: float, moving: np.ndarray, base: np.ndarray | None = None) -> tuple[StreamState, LinkAngles]:
        """The state at a first sample q, v, a (3, k) of an unknown history, and its link angles (1, k)."""
        drives, found, root = self.prepared, self.found, self.at_rest if base is None else base
        samples, angles = np.empty((4, len(drives.columns))), np.empty((4, 1, moving.shape[1]))
        link_streams.loaded(self.trains.dynamics.tree, drives, root, self.work, found, moving, samples)
        states = begun(self.trains, drives, samples[TORQUE], found.stiffness[0])
        link_streams.link_angles(states, moving, drives, angles)
        moment = link_streams.borne(states, drives, found)
        return StreamState(t, moving, samples, states, found.torque.copy(), moment), _named(angles, moment)

    def step(
        self, before: StreamState, t: float, moving: np.ndarray, base: np.ndarray | None = None
    ) -> tuple[StreamState, LinkAngles]:
        """The state one sample q, v, a (3, k) later, link angles (1, k); `base` (1, 12) as `Dynamics.root` has it."""
        samples, states, torque, moment, angles = link_streams.advanced_drives(
            self._unnamed, self.at_rest if base is None else base, moving, before.samples, before.states, t - before.t,
            LONGEST,
        )  # fmt: skip
        return StreamState(t, moving, samples, states, torque, moment), _named(angles, moment)

    @cached_property
    def _unnamed(self) -> Unnamed:
        return tuple(self.trains.dynamics.tree), tuple(self.prepared), tuple(self.found), self.work


def _named(angles: np.ndarray, moment: np.ndarray) -> LinkAngles:
    """Angles (4, 1, k) of the kernel."""
    q, low, high, variance = angles
    return LinkAngles(q, low, high, variance, moment)


def stream_of(trains: DriveTrains) -> Stream:
    """Drive trains made ready for single samples."""
    robot = trains.dynamics
    return Stream(
        trains, prepared(trains), robot.root(None), scratch(robot.tree), room(1, len(trains.joints), regressors=True)
    )
