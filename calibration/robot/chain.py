"""The kinematic chain from the base frame to the tool frame, and its derivatives.

    T_base_tool(q, xi) = prod_i M_i exp6(xi_i) J_i(q_i) * T_last_tool

The placement M_i of each joint moves on the right, before the joint's motion: M_i <- M_i exp6(xi_i) [m, rad].
Derivatives are local twists of the tool frame: T(x + dx) = T(x) exp6(J dx).
Joints that are not measured stay at their neutral position. Nothing here edits the model it was given.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin

from calibration.errors import InputError, NoSuchElement, ShapeError
from calibration.numerics.lie import exp6, jexp6
from calibration.recording.schema import Description, Payload
from calibration.robot.gravity import Loads, gravity_moments, gravity_torques, loads_of
from calibration.robot.kinematics import Path, path_of


@dataclass(frozen=True)
class Chain:
    """The measured joints between two frames of a robot.

    Attributes:
        nominal: All measured joints, the others locked at neutral.
        measured: Names of the measured joints, the columns of every `q`.
        joints: Names of those on the way from base to tool, base first.
        base_frame: Name of the frame poses are expressed in.
        tool_frame: Name of the frame whose pose is meant.
        xi: (k, 6) placement twists [m, rad].
        nominal_path: The path from base to tool.
        loads: Bodies moved by the measured joints, and the payload.
    """

    nominal: pin.Model
    measured: tuple[str, ...]
    joints: tuple[str, ...]
    base_frame: str
    tool_frame: str
    xi: np.ndarray
    nominal_path: Path
    loads: Loads

    @property
    def columns(self) -> list[int]:
        """Column in `q` of each joint of the chain."""
        return [self.measured.index(name) for name in self.joints]

    @cached_property
    def model(self) -> pin.Model:
        """The nominal model with the placement twists applied."""
        model = self.nominal.copy()
        for name, xi in zip(self.joints, self.xi, strict=True):
            i = model.getJointId(name)
            model.jointPlacements[i] = model.jointPlacements[i] * pin.exp6(xi)
        return model

    @cached_property
    def path(self) -> Path:
        """The path from base to tool with the placement twists applied."""
        return self.nominal_path.moved(np.concatenate([exp6(self.xi), np.eye(4)[None]]))

    @cached_property
    def twists(self) -> np.ndarray:
        """Local twists by placement twist and joint position (k + 1, 6, 7) of the frame before each joint.

        The first is the base's, which none of them moves.
        """
        out = np.zeros((len(self.joints) + 1, 6, 7))
        out[1:, :, :6], out[1:, :, 6] = jexp6(self.xi), self.nominal_path.twists
        return out

    @cached_property
    def _ways(self) -> dict[str, tuple[Path, list[int]]]:
        """Paths from the base to frames that were asked for, and the columns of their joints."""
        return {}

    def with_placements(self, xi: np.ndarray) -> "Chain":
        """The chain with placement twists `xi` (k, 6) [m, rad] instead of those it has."""
        if xi.shape != self.xi.shape:
            raise ShapeError("xi", xi.shape, self.xi.shape)
        return replace(self, xi=np.array(xi))

    def poses(self, q: np.ndarray, frame: str | None = None) -> np.ndarray:
        """T_base_frame (n, 4, 4) at q (n, n_measured) [rad, m]; the tool frame where none is named."""
        self._check(q)
        if frame is None:
            return self.path.poses(q[:, self.columns])
        if frame not in self._ways:
            end = self._frame(frame)
            names = [self.model.names[i] for i in self.model.supports[self.model.frames[end].parentJoint] if i != 0]
            path = path_of(self.model, self._frame(self.base_frame), end)
            self._ways[frame] = path, [self.measured.index(name) for name in names]
        path, columns = self._ways[frame]
        return path.poses(q[:, columns])

    def joint_jacobians(self, q: np.ndarray) -> np.ndarray:
        """Derivatives of the tool's pose by joint position (n, 6, k), local twists, at q (n, n_measured)."""
        self._check(q)
        return self.path.placed(q[:, self.columns]).end_twists(self.twists[:, :, 6:])[:, :, 1:, 0]

    def gravity_torques(self, q: np.ndarray) -> np.ndarray:
        """Torques (n, k) [N.m, N] that hold the chain's joints at q (n, n_measured), nominal geometry and masses."""
        return gravity_torques(self.loads, q)[:, self.columns]

    def gravity_moments(self, q: np.ndarray) -> np.ndarray:
        """Moments (n, k, 3) [N.m] of gravity across the axes of the chain's joints, see `gravity`."""
        return gravity_moments(self.loads, q)[:, self.columns]

    def carrying(self, mass: float | None) -> "Chain":
        """The chain with another mass [kg] of its payload; itself where None."""
        return self if mass is None else replace(self, loads=self.loads.carrying(mass))

    def configurations(self, q: np.ndarray) -> np.ndarray:
        """Readings q (n, n_measured) in the model's own order and format, (n, nq)."""
        self._check(q)
        order = [self.measured.index(name) for name in list(self.nominal.names)[1:]]
        neutral = pin.neutral(self.nominal)
        if self.nominal.nq == self.nominal.nv:
            return neutral + q[:, order]
        return np.array([pin.integrate(self.nominal, neutral, row) for row in q[:, order]])

    @cached_property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper joint limits of `measured` [rad, m], -inf and inf for a continuous joint."""
        lower, upper = np.full(len(self.measured), -np.inf), np.full(len(self.measured), np.inf)
        for column, name in enumerate(self.measured):
            joint = self.nominal.joints[self.nominal.getJointId(name)]
            if joint.nq == 1:
                lower[column] = self.nominal.lowerPositionLimit[joint.idx_q]
                upper[column] = self.nominal.upperPositionLimit[joint.idx_q]
        return lower, upper

    def is_prismatic(self, joint: str) -> bool:
        """Whether a joint's reading is a length."""
        return "JointModelP" in self.nominal.joints[self.nominal.getJointId(joint)].shortname()

    def _check(self, q: np.ndarray) -> None:
        if q.ndim != 2 or q.shape[1] != len(self.measured):
            raise ShapeError("q", q.shape, ("n", len(self.measured)))

    def _frame(self, name: str) -> int:
        frame_id = self.nominal.getFrameId(name)
        if frame_id == self.nominal.nframes:
            raise NoSuchElement("frame", name, [f.name for f in self.nominal.frames])
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
    """The nominal chain of a dataset, with its declared payload and gravity."""
    frames = description.base_frame, description.tool_frame
    return chain_of_frames(urdf, description.joint_names, *frames, description.payload, description.gravity)


def chain_of_frames(
    urdf: str,
    measured: tuple[str, ...],
    base_frame: str,
    tool_frame: str,
    payload: Payload | None = None,
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81),
) -> Chain:
    """The nominal chain of the measured joints between two frames; gravity [m/s2] in the robot's root frame.

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
    several = [name for name in joints if model.joints[model.getJointId(name)].nv != 1]
    if several:
        raise InputError("nominal.urdf", f"joints {several} have more than one degree of freedom; none of a chain may")
    path = path_of(model, model.getFrameId(base.name), model.getFrameId(tool.name))
    return Chain(
        model,
        measured,
        joints,
        base.name,
        tool.name,
        np.zeros((len(joints), 6)),
        path,
        loads_of(model, measured, payload, gravity),
    )
