"""Drive trains sample by sample: the state is passed from one to the next, nothing after a sample is read.

    state, angles = stream.step(state, t, [q_motor, velocity, acceleration])

With the velocities and accelerations that `torques.derivatives` has of a recording, the angles are those in one go.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from calibration.robot.rigid_tree import scratch
from calibration.robot.tree_dynamics import TreeDynamics, room
from calibration.stages.drive_trains.drive_train import LONGEST
from calibration.stages.drive_trains.drive_trains import RUNS, DriveTrains, LinkAngles, begun, prepared, swayed
from calibration.stages.drive_trains.kernel import link_streams
from calibration.stages.drive_trains.kernel.link_streams import TORQUE, Drives


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
        state, found, angles = self._room(t, moving)
        robot, drives, states = self.trains.dynamics, self.prepared, state.states
        root = self.at_rest if base is None else base
        link_streams.loaded(robot.tree, drives, root, self.work, found, state.moving, state.samples)
        states[:] = begun(self.trains, drives, state.samples[TORQUE], found.stiffness[0])
        link_streams.link_angles(states, state.moving, drives, angles)
        return state, self._leaning(state, angles)

    def step(
        self, before: StreamState, t: float, moving: np.ndarray, base: np.ndarray | None = None
    ) -> tuple[StreamState, LinkAngles]:
        """The state one sample q, v, a (3, k) later, link angles (1, k); `base` (1, 12) as `Dynamics.root` has it."""
        state, found, angles = self._room(t, moving)
        robot, drives = self.trains.dynamics, self.prepared
        state.states[:] = before.states
        root = self.at_rest if base is None else base
        link_streams.advanced_drives(
            robot.tree, drives, root, self.work, found, state.moving, before.samples, state.states, t - before.t,
            LONGEST, state.samples, angles,
        )  # fmt: skip
        return state, self._leaning(state, angles)

    def _leaning(self, state: StreamState, angles: np.ndarray) -> LinkAngles:
        """Angles (4, 1, k) with the moments of `LinkAngles`, which take the place of a rigid column's in the state."""
        lean = state.states[len(self.trains.trains) :, 0, 0]
        state.moment[0] = swayed(self.prepared, lean[None], state.moment)[0]
        q, low, high, variance = angles
        return LinkAngles(q, low, high, variance, state.moment)

    def _room(self, t: float, moving: np.ndarray) -> tuple[StreamState, TreeDynamics, np.ndarray]:
        """A state, dynamics and link angles (4, 1, k) to be filled."""
        m, k, scratch = len(self.prepared.columns), moving.shape[1], self.found
        torque, moment, angles = np.empty((1, k)), np.empty((1, 2)), np.empty((4, 1, k))
        found = TreeDynamics(
            torque, scratch.inertia, scratch.root, moment, scratch.composite, scratch.coupling, scratch.stiffness,
            scratch.regressor,
        )  # fmt: skip
        return StreamState(t, moving, np.empty((4, m)), np.zeros((m, RUNS, 3)), torque, moment), found, angles


def stream_of(trains: DriveTrains) -> Stream:
    """Drive trains made ready for single samples."""
    robot = trains.dynamics
    return Stream(
        trains, prepared(trains), robot.root(None), scratch(robot.tree), room(1, len(trains.joints), regressors=True)
    )
