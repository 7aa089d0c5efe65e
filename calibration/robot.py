"""The kinematic chain from the base frame to the tool frame, and its derivatives.

    T_base_tool(q, xi) = prod_i M_i exp6(xi_i) J_i(q_i) * T_last_tool

The placement M_i of each joint moves on the right, before the joint's motion: M_i <- M_i exp6(xi_i) [m, rad].
Derivatives are local twists of the tool frame: T(x + dx) = T(x) exp6(J dx).
Joints that are not measured stay at their neutral position. Nothing here edits the model it was given.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from calibration.errors import InputError, NoSuchElement, ShapeError
from calibration.schema import Description


@dataclass(frozen=True)
class ChainPoses:
    """Poses of the tool frame and their derivatives, for n configurations of k joints.

    Attributes:
        T: (n, 4, 4) T_base_tool.
        J_placement: (n, 6, 6 k), by finite placement twists, joint by joint.
        J_joint: (n, 6, k), by joint position.
    """

    T: np.ndarray
    J_placement: np.ndarray
    J_joint: np.ndarray


@dataclass(frozen=True)
class Chain:
    """The measured joints between two frames of a robot.

    Attributes:
        model: All measured joints, the others locked at neutral, with `xi` applied.
        measured: Names of the measured joints, the columns of every `q`.
        joints: Names of those on the way from base to tool, base first.
        base_frame: Name of the frame poses are expressed in.
        tool_frame: Name of the frame whose pose is meant.
        xi: (k, 6) placement twists already applied [m, rad].
    """

    model: pin.Model
    measured: tuple[str, ...]
    joints: tuple[str, ...]
    base_frame: str
    tool_frame: str
    xi: np.ndarray

    @property
    def columns(self) -> list[int]:
        """Column in `q` of each joint of the chain."""
        return [self.measured.index(name) for name in self.joints]

    def with_placements(self, xi: np.ndarray) -> "Chain":
        """The chain with placement twists `xi` (k, 6) [m, rad] instead of those it has."""
        if xi.shape != self.xi.shape:
            raise ShapeError("xi", xi.shape, self.xi.shape)
        model = self.model.copy()
        for name, old, new in zip(self.joints, self.xi, xi, strict=True):
            i = model.getJointId(name)
            model.jointPlacements[i] = model.jointPlacements[i] * pin.exp6(old).inverse() * pin.exp6(new)
        return replace(self, model=model, xi=np.array(xi))

    def poses(self, q: np.ndarray, frame: str | None = None) -> np.ndarray:
        """T_base_frame (n, 4, 4) at q (n, n_measured) [rad, m]; the tool frame where none is named."""
        data, base, end = self.model.createData(), self._frame(self.base_frame), self._frame(frame or self.tool_frame)
        T = np.empty((len(q), 4, 4))
        for k, q_k in enumerate(self.configurations(q)):
            pin.forwardKinematics(self.model, data, q_k)
            T_base = pin.updateFramePlacement(self.model, data, base)
            T[k] = T_base.actInv(pin.updateFramePlacement(self.model, data, end)).homogeneous
        return T

    def poses_and_derivatives(self, q: np.ndarray) -> ChainPoses:
        """Poses of the tool frame with d(pose)/d(xi) and d(pose)/dq, at q (n, n_measured) [rad, m]."""
        model, data, tool = self.model, self.model.createData(), self._frame(self.tool_frame)
        ids = [model.getJointId(name) for name in self.joints]
        right = [pin.Jexp6(pin.Motion(xi)) for xi in self.xi]
        J_placement = np.empty((len(q), 6, 6 * len(ids)))
        for row, q_row in enumerate(self.configurations(q)):
            # The regressor reads data.oMf: it is garbage unless the frames were updated first.
            pin.forwardKinematics(model, data, q_row)
            pin.updateFramePlacements(model, data)
            regressor = pin.computeFrameKinematicRegressor(model, data, tool, pin.LOCAL)
            for j, (i, J_exp) in enumerate(zip(ids, right, strict=True)):
                J_placement[row, :, 6 * j : 6 * j + 6] = regressor[:, 6 * (i - 1) : 6 * i] @ J_exp
        return ChainPoses(self.poses(q), J_placement, self.joint_jacobians(q))

    def joint_jacobians(self, q: np.ndarray) -> np.ndarray:
        """Derivatives of the tool's pose by joint position (n, 6, k), local twists, at q (n, n_measured)."""
        model, data, tool = self.model, self.model.createData(), self._frame(self.tool_frame)
        columns = [model.joints[model.getJointId(name)].idx_v for name in self.joints]
        rows = [pin.computeFrameJacobian(model, data, x, tool, pin.LOCAL)[:, columns] for x in self.configurations(q)]
        return np.array(rows).reshape(len(q), 6, len(columns))

    def configurations(self, q: np.ndarray) -> np.ndarray:
        """Readings q (n, n_measured) in the model's own order and format, (n, nq)."""
        if q.ndim != 2 or q.shape[1] != len(self.measured):
            raise ShapeError("q", q.shape, ("n", len(self.measured)))
        order = [self.measured.index(name) for name in list(self.model.names)[1:]]
        neutral = pin.neutral(self.model)
        if self.model.nq == self.model.nv:
            return neutral + q[:, order]
        return np.array([pin.integrate(self.model, neutral, row) for row in q[:, order]])

    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper joint limits of `measured` [rad, m], -inf and inf for a continuous joint."""
        lower, upper = np.full(len(self.measured), -np.inf), np.full(len(self.measured), np.inf)
        for column, name in enumerate(self.measured):
            joint = self.model.joints[self.model.getJointId(name)]
            if joint.nq == 1:
                lower[column] = self.model.lowerPositionLimit[joint.idx_q]
                upper[column] = self.model.upperPositionLimit[joint.idx_q]
        return lower, upper

    def is_prismatic(self, joint: str) -> bool:
        """Whether a joint's reading is a length."""
        return "JointModelP" in self.model.joints[self.model.getJointId(joint)].shortname()

    def _frame(self, name: str) -> int:
        frame_id = self.model.getFrameId(name)
        if frame_id == self.model.nframes:
            raise NoSuchElement("frame", name, [f.name for f in self.model.frames])
        return frame_id


def reduced_model(urdf: str, measured: tuple[str, ...], root: pin.JointModel | None = None) -> pin.Model:
    """The URDF's model with every joint that is not measured (nor the root) locked at neutral."""
    try:
        full = pin.buildModelFromXML(urdf) if root is None else pin.buildModelFromXML(urdf, root)
    except (ValueError, RuntimeError) as error:
        raise InputError("nominal.urdf", f"not a URDF Pinocchio can build ({error})") from error
    for name in measured:
        if not full.existJointName(name):
            raise NoSuchElement("joint", name, list(full.names))
    kept = {"universe", *measured} | ({full.names[1]} if root is not None else set())
    locked = [full.getJointId(name) for name in full.names if name not in kept]
    return pin.buildReducedModel(full, locked, pin.neutral(full))


def chain_of(urdf: str, description: Description) -> Chain:
    """The nominal chain of a dataset."""
    return chain_of_frames(urdf, description.joint_names, description.base_frame, description.tool_frame)


def chain_of_frames(urdf: str, measured: tuple[str, ...], base_frame: str, tool_frame: str) -> Chain:
    """The nominal chain of the measured joints between two frames.

    Raises:
        NoSuchElement: A joint or frame is not in the URDF.
        InputError: The base frame moves with a measured joint, or no measured joint carries the tool.
    """
    model = reduced_model(urdf, measured)
    frames = {f.name: f for f in model.frames}
    for name in (base_frame, tool_frame):
        if name not in frames:
            raise NoSuchElement("frame", name, list(frames))
    base, tool = frames[base_frame], frames[tool_frame]
    if base.parentJoint != 0:
        raise InputError("dataset.json", f"base_frame {base.name!r} moves with joint {model.names[base.parentJoint]!r}")
    joints = tuple(model.names[i] for i in model.supports[tool.parentJoint] if i != 0)
    if not joints:
        raise InputError("dataset.json", f"no measured joint between {base.name!r} and tool_frame {tool.name!r}")
    xi = np.zeros((len(joints), 6))
    return Chain(model, measured, joints, base.name, tool.name, xi)
