"""The base of row `full` in use: it sticks and slips under a plate's wrench and the arm's inertia.

    T_lab_base(t) = T_lab_0 exp(x(t)) T_lab_0^-1 T_lab_base(start)        covariance of x: diag V(t), in frame 0

x, y, yaw by the stick-slip model, z and tilt by the compliance, as in the evaluation's row. Sample by sample the
wrench is taken as it comes, and inverse dynamics leave out the inertia of heave and tilt.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin

from calibration.numerics.signals import interpolate_columns
from calibration.prediction.base_pose import BaseState, LoadedBase
from calibration.robot.floating_base import configurations
from calibration.robot.laboratory import Laboratory
from calibration.stages.stick_slip.forcing import CUTOFF, HEAVE, PLANE, UPPER, planar_forcing, wrenches_along
from calibration.stages.stick_slip.model import StickSlip
from calibration.stages.stick_slip.stream import Sample, SlipStream, slip_stream
from calibration.stages.suspension.floor_wrench import root_in_base


@dataclass(frozen=True)
class Motion:
    """One sample of the arm: motor readings, velocities and accelerations, (k,) each [rad, m, s]."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray


@dataclass(frozen=True)
class SlippingBase:
    """A base that sticks and slips, wherever it stands.

    Attributes:
        model: Fitted with a plate.
        lab: The nominal robot with the payload in its hand.
    """

    model: StickSlip
    lab: Laboratory

    def moved(
        self, at: LoadedBase, t: np.ndarray, q_motor: np.ndarray, wrench: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """How the base moved in the lab (n, 4, 4) and variances (n, 6) of its displacement in frame 0.

        Raises:
            NotEnoughData: Less than a second, or nothing says what point the wrench is about.
        """
        wrenches = wrenches_along(self.lab, t, q_motor, at.load(t, wrench, CUTOFF), at.T_lab_0)
        forcing = planar_forcing(wrenches, self.model.tilting, "plate")
        x, variance = (interpolate_columns(t, forcing.t, found) for found in self.model.displacement(forcing))
        return at.in_lab(x), variance

    def stepped(
        self, at: LoadedBase, t: float, wrench: np.ndarray, motion: Motion | None, before: BaseState | None
    ) -> BaseState:
        """The base one sample on; without the arm's motion it has no inertia, and the plate alone moves it."""
        state = at.stepped(t, wrench, before)
        sample = Sample(t, state.wrench, state.x[3:5])
        if motion is not None:
            w, M = self._driven(at.T_lab_0, motion)
            inertia = np.array([M[PLANE[i], PLANE[j]] for i, j in UPPER])
            sample = replace(sample, driving=w[list(PLANE)], inertia=inertia)
        slip = self._stream.stepped(sample, None if before is None else before.slip)
        x = state.x.copy()
        linear = self._stream.direction.linear
        x[list(PLANE)] = np.where(linear, x[list(PLANE)], slip.x)
        return replace(state, moved=at.in_lab(x[None]), slip=slip)

    def variance(self, state: BaseState) -> np.ndarray:
        """(6,) of the displacement in frame 0 [m2, rad2]."""
        found, own = np.empty(6), self._stream.direction
        found[list(PLANE)] = np.zeros(3) if state.slip is None else state.slip.variance(own)
        found[list(HEAVE)] = own.heave_variance
        return found

    def _driven(self, T_lab_0: np.ndarray, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
        """Wrench (6,) of inverse dynamics on the floor, and inertia (6, 6), both in frame 0."""
        model, (order, T_0_root, dual, action, data) = self.lab.floating, self._root
        root = (pin.SE3(T_lab_0) * T_0_root).homogeneous[None]
        q = configurations(model, root, motion.q[None, order])[0]
        v, a = (np.concatenate([np.zeros(6), x[order]]) for x in (motion.v, motion.a))
        w = -dual @ pin.rnea(model, data, q, v, a)[:6]
        M = pin.crba(model, data, q)[:6, :6]
        return w, dual @ (np.triu(M) + np.triu(M, 1).T) @ action

    @cached_property
    def _root(self) -> tuple[list[int], pin.SE3, np.ndarray, np.ndarray, pin.Data]:
        """Order of the joints, T_0_root, how it acts on wrenches and back on twists, scratch of the dynamics."""
        model, description = self.lab.floating, self.lab.description
        order = [description.joint_names.index(name) for name in list(model.names)[2:]]
        T = root_in_base(model, description)
        return order, T, T.dualAction, T.inverse().action, model.createData()

    @cached_property
    def _stream(self) -> SlipStream:
        return slip_stream(self.model)
