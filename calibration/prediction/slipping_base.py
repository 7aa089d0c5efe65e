"""The base of row `full` in use: it sticks and slips under a plate's wrench, or that of the arm's own inertia.

    T_lab_base(t) = T_lab_0 exp(x(t)) T_lab_0^-1 T_lab_base(start)        covariance of x: diag V(t), in frame 0

x, y, yaw by the stick-slip model, z and tilt by the compliance, as in the evaluation's row. Sample by sample the
wrench is taken as it comes, and inverse dynamics leave out the inertia of heave and tilt.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit

from calibration.numerics.signals import interpolate_columns
from calibration.prediction.base_pose import BaseState, LoadedBase
from calibration.robot.laboratory import Laboratory
from calibration.robot.rigid_tree import RigidTree, TreeDynamics, room, sample, scratch
from calibration.stages.stick_slip.forcing import CUTOFF, HEAVE, PLANE, UPPER, planar_forcing, wrenches_along
from calibration.stages.stick_slip.kernel import ACCELERATION, LANES
from calibration.stages.stick_slip.model import StickSlip
from calibration.stages.stick_slip.stream import Sample, SlipStream, slip_stream
from calibration.stages.suspension.floor_wrench import root_in_base
from calibration.stages.suspension.model import Source

_UPPER = tuple((PLANE[i], PLANE[j]) for i, j in UPPER)


@dataclass(frozen=True)
class SlippingBase:
    """A base that sticks and slips, wherever it stands.

    Attributes:
        model: Fitted from `source`.
        lab: The nominal robot with the payload in its hand.
        source: What moves it: a plate's wrench, or inverse dynamics of the readings.
    """

    model: StickSlip
    lab: Laboratory
    source: Source

    def moved(
        self,
        at: LoadedBase,
        t: np.ndarray,
        q_motor: np.ndarray,
        wrench: np.ndarray | None,
        push: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """How the base moved in the lab (n, 4, 4) and variances (n, 6) of its displacement in frame 0.

        Without a plate's wrench inverse dynamics move it; the hand may be pushed by (n, 6).

        Raises:
            NotEnoughData: Less than a second, or nothing says what point the wrench is about.
        """
        load = None if wrench is None else at.load(t, wrench, CUTOFF)
        forcing = planar_forcing(
            wrenches_along(self.lab, t, q_motor, load, at.T_lab_0, push), self.model.tilting, self.source
        )
        x, variance = (interpolate_columns(t, forcing.t, found) for found in self.model.displacement(forcing))
        return at.in_lab(x), variance

    def stepped(
        self, at: LoadedBase, t: float, wrench: np.ndarray, moving: np.ndarray | None, before: BaseState | None
    ) -> BaseState:
        """The base one sample on; without the arm's motion (3, k) it has no inertia, and the plate alone moves it.

        `moving` are motor readings, velocities and accelerations [rad, m, s].
        """
        state = at.sprung(t, wrench, before, self.model.wheels.borne)
        driving = None if moving is None else self._driven(at.gravity, moving)
        slip = self._stream.stepped(
            Sample(t, state.wrench, state.x[3:5], driving), None if before is None else before.slip
        )
        x = state.x.copy()
        for axis, own, linear in self._axes:
            if not linear:
                x[axis] = slip.x[own]
        return state._replace(moved=at.in_lab(x[None]), slip=slip)

    def variance(self, state: BaseState) -> np.ndarray:
        """(6,) of the displacement in frame 0 [m2, rad2]."""
        found, own = np.empty(6), self._stream.direction
        found[list(PLANE)] = np.zeros(3) if state.slip is None else state.slip.variance(own)
        found[list(HEAVE)] = own.heave_variance
        return found

    def accelerations(self, at: LoadedBase, state: BaseState) -> np.ndarray | None:
        """(2, 3) linear and angular of the base frame [m/s2, rad/s2, lab axes], mean of the members; None at rest."""
        if state.slip is None:
            return None
        return np.asarray(_accelerations(state.slip.bases.state, len(self._stream.direction.ensemble), at.T_lab_0))

    def _driven(self, gravity: np.ndarray, moving: np.ndarray) -> np.ndarray:
        """What the arm does to the base in the floor's plane (9,), see `Sample`; gravity (3,) in frame 0."""
        tree, actions, work, found = self._robot
        return np.asarray(driven(tree, actions, gravity, moving, work, found))

    @cached_property
    def _robot(self) -> tuple[RigidTree, tuple[np.ndarray, np.ndarray], np.ndarray, TreeDynamics]:
        """The tree, how T_0_root acts on wrenches and back on twists (6, 6), scratch of the dynamics."""
        T, tree = root_in_base(self.lab.floating, self.lab.description), self.lab.tree
        actions = np.array(T.dualAction, order="C"), np.array(T.inverse().action, order="C")
        return tree, actions, scratch(tree), room(1, len(tree.column))

    @cached_property
    def _axes(self) -> tuple[tuple[int, int, bool], ...]:
        """Axis of the displacement, its place in the plane, whether the compliance has it."""
        return tuple((axis, k, bool(self._stream.direction.linear[k])) for k, axis in enumerate(PLANE))

    @cached_property
    def _stream(self) -> SlipStream:
        return slip_stream(self.model)


@njit(cache=True, error_model="numpy")
def _accelerations(states: np.ndarray, members: int, T_lab_0: np.ndarray) -> np.ndarray:
    """`SlippingBase.accelerations` of the first of the bases, states as in `kernel.Bases`."""
    found = np.zeros((2, 3))
    for k in range(members):
        a = states[k // LANES, ACCELERATION : ACCELERATION + 3, k % LANES]
        for i in range(3):
            found[0, i] += (T_lab_0[i, 0] * a[0] + T_lab_0[i, 1] * a[1]) / members
            found[1, i] += T_lab_0[i, 2] * a[2] / members
    return found


@njit(cache=True, error_model="numpy")
def driven(
    tree: RigidTree,
    actions: tuple[np.ndarray, np.ndarray],
    gravity: np.ndarray,
    moving: np.ndarray,
    work: np.ndarray,
    found: TreeDynamics,
) -> np.ndarray:
    """`SlippingBase._driven` at readings, velocities and accelerations (3, k)."""
    (dual, back), root, out = actions, np.zeros((1, 12)), np.zeros(9)
    for i in range(3):
        for c in range(3):
            root[0, 6 + i] -= back[i, c] * gravity[c]
    sample(tree, moving[0:1], moving[1:2], moving[2:3], root, work, found)
    for i in range(3):
        for r in range(6):
            out[i] -= dual[PLANE[i], r] * found.root[0, r]
    for k in range(6):
        i, j = _UPPER[k]
        for r in range(6):
            for c in range(6):
                out[3 + k] += dual[i, r] * found.composite[0, r, c] * back[c, j]
    return out
