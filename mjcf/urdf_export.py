"""URDF text of a compiled robot: kinematics, inertias, limits and shapes, to the last digit.

A body becomes a link, its placement in its parent the origin of a joint of the same frame. Inertias, kept by MuJoCo in
principal axes, are turned back into the link's:

    I_link = R_link_principal diag(I_principal) R_link_principal^T        [kg m2], about the centre of mass

The free joint is left out: the root link is the robot's root body, and who reads the URDF adds the floating base.
A joint's `actuatorfrcrange` becomes its effort limit, its first `user` value its velocity limit. A fixed joint has no
name in MJCF: it is called after its child. Floats are written by `repr`, which reads back to the same double.

Shapes are geoms of group 2, those that are seen. A capsule becomes a cylinder and its two end spheres; an ellipsoid,
which URDF does not have, three cylinders along its z as wide as it is in the middle of each third (semi-axes a, b:
sqrt(a b)).
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator
from functools import cache

import mujoco
import numpy as np

from mjcf.nominal import ROOT
from mjcf.nominal import model as nominal

_SEEN = 2  # group of the geoms that a camera sees
_NO_YAW = 8.0 * np.finfo(float).eps


class NotAUrdfTree(ValueError):
    """A body whose joints a URDF cannot say."""

    def __init__(self, body_name: str, reason: str) -> None:
        super().__init__(
            f"body {body_name!r} {reason}; a URDF link has at most one hinge or slide, at the origin of its frame"
        )
        self.body_name = body_name


def urdf(model: mujoco.MjModel | None = None) -> str:
    """Return the URDF of the robot under base_footprint.

    Args:
        model: A compiled robot; the nominal one by default.

    Raises:
        NotAUrdfTree: a body has several joints, a ball joint, or a joint away from its frame's origin.
    """
    return _nominal() if model is None else _urdf(model)


@cache
def _nominal() -> str:
    return _urdf(nominal())


def _urdf(model: mujoco.MjModel) -> str:
    root_id = model.body(ROOT).id
    robot = ET.Element("robot", name="tiago")
    for body_id in _subtree(model, root_id):
        robot.append(_link(model, body_id))
        if body_id != root_id:
            robot.append(_joint(model, body_id))
    ET.indent(robot)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _subtree(model: mujoco.MjModel, root_id: int) -> list[int]:
    """Return the indices of a body and all its descendants, parents first."""
    inside = {root_id}
    for body_id in range(root_id + 1, model.nbody):
        if model.body_parentid[body_id] in inside:
            inside.add(body_id)
    return sorted(inside)


def _link(model: mujoco.MjModel, body_id: int) -> ET.Element:
    """Return the link of a body: its inertia about the centre of mass, in link axes, and its shapes."""
    link = ET.Element("link", name=model.body(body_id).name)
    if model.body_mass[body_id] > 0.0:
        link.append(_inertial(model, body_id))
    link.extend(_collisions(model, body_id))
    return link


def _inertial(model: mujoco.MjModel, body_id: int) -> ET.Element:
    """Return mass, centre of mass and inertia about it."""
    inertial = ET.Element("inertial")
    R = _matrix(model.body_iquat[body_id])
    inertia = R @ np.diag(model.body_inertia[body_id]) @ R.T
    ET.SubElement(inertial, "origin", xyz=_text(model.body_ipos[body_id]), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=_text([model.body_mass[body_id]]))
    upper = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    ET.SubElement(inertial, "inertia", {name: _text([inertia[ij]]) for name, ij in upper.items()})
    return inertial


def _joint(model: mujoco.MjModel, body_id: int) -> ET.Element:
    """Return the joint between a body and its parent."""
    n_joints, joint_id = int(model.body_jntnum[body_id]), int(model.body_jntadr[body_id])
    name = model.body(body_id).name
    if n_joints > 1:
        raise NotAUrdfTree(name, f"has {n_joints} joints")
    moving = n_joints == 1
    joint = ET.Element(
        "joint",
        name=model.joint(joint_id).name if moving else name.removesuffix("_link") + "_joint",
        type=_joint_type(model, joint_id, name) if moving else "fixed",
    )
    ET.SubElement(joint, "parent", link=model.body(model.body_parentid[body_id]).name)
    ET.SubElement(joint, "child", link=name)
    rpy = rpy_from_matrix(_matrix(model.body_quat[body_id]))
    ET.SubElement(joint, "origin", xyz=_text(model.body_pos[body_id]), rpy=_text(rpy))
    if moving:
        ET.SubElement(joint, "axis", xyz=_text(model.jnt_axis[joint_id]))
        limits = _limits(model, joint_id)
        if limits:
            ET.SubElement(joint, "limit", limits)
    return joint


def _joint_type(model: mujoco.MjModel, joint_id: int, body_name: str) -> str:
    """Return the URDF type of a moving joint."""
    if np.any(model.jnt_pos[joint_id] != 0.0):
        raise NotAUrdfTree(body_name, f"turns about a point at {model.jnt_pos[joint_id]} m")
    if model.jnt_type[joint_id] == mujoco.mjtJoint.mjJNT_SLIDE:
        return "prismatic"
    if model.jnt_type[joint_id] == mujoco.mjtJoint.mjJNT_HINGE:
        return "revolute" if model.jnt_limited[joint_id] else "continuous"
    raise NotAUrdfTree(body_name, f"has joint {model.joint(joint_id).name!r}, a ball or a free joint")


def _limits(model: mujoco.MjModel, joint_id: int) -> dict[str, str]:
    """Return the limits that the model has of a joint: position, effort, velocity."""
    limits = {}
    if model.jnt_limited[joint_id]:
        limits["lower"], limits["upper"] = (_text([bound]) for bound in model.jnt_range[joint_id])
    if model.jnt_actfrclimited[joint_id]:
        limits["effort"] = _text([model.jnt_actfrcrange[joint_id, 1]])
    if model.nuser_jnt and model.jnt_user[joint_id, 0] > 0.0:
        limits["velocity"] = _text([model.jnt_user[joint_id, 0]])
    return limits


def _matrix(quat_wxyz: np.ndarray) -> np.ndarray:
    """Return the rotation matrix (3, 3) of a quaternion."""
    R = np.empty(9)
    mujoco.mju_quat2Mat(R, quat_wxyz / np.linalg.norm(quat_wxyz))
    return R.reshape(3, 3)


def _text(values: Iterable[float]) -> str:
    """Return numbers as URDF text, shortest form that reads back to the same doubles."""
    return " ".join(repr(float(value) + 0.0).removesuffix(".0") for value in values)


def _collisions(model: mujoco.MjModel, body_id: int) -> Iterator[ET.Element]:
    """Collision elements of a body."""
    first = int(model.body_geomadr[body_id])
    for geom_id in range(first, first + int(model.body_geomnum[body_id])):
        if model.geom_group[geom_id] != _SEEN:
            continue
        R = np.empty(9)
        mujoco.mju_quat2Mat(R, model.geom_quat[geom_id])
        for shape, along_z in _shapes(int(model.geom_type[geom_id]), model.geom_size[geom_id]):
            collision = ET.Element("collision")
            origin = model.geom_pos[geom_id] + along_z * R.reshape(3, 3)[:, 2]
            rpy = rpy_from_matrix(R.reshape(3, 3))
            ET.SubElement(collision, "origin", xyz=_text(origin), rpy=_text(rpy))
            ET.SubElement(collision, "geometry").append(shape)
            yield collision


def _shapes(kind: int, size: np.ndarray) -> Iterator[tuple[ET.Element, float]]:
    """URDF shapes of a geom and how far along its z they stand [m]; other kinds have none."""
    of = mujoco.mjtGeom
    if kind == of.mjGEOM_BOX:
        yield ET.Element("box", size=_text(2.0 * size)), 0.0
    elif kind == of.mjGEOM_SPHERE:
        yield ET.Element("sphere", radius=_text(size[:1])), 0.0
    elif kind == of.mjGEOM_ELLIPSOID:
        wide, third = float(np.sqrt(size[0] * size[1])), 2.0 * float(size[2]) / 3.0
        for k in (-1, 0, 1):
            radius = wide * np.sqrt(1.0 - (2.0 * k / 3.0) ** 2)
            yield ET.Element("cylinder", radius=_text([radius]), length=_text([third])), k * third
    elif kind in (of.mjGEOM_CYLINDER, of.mjGEOM_CAPSULE):
        yield ET.Element("cylinder", radius=_text(size[:1]), length=_text([2.0 * size[1]])), 0.0
        if kind == of.mjGEOM_CAPSULE:
            for end in (-size[1], size[1]):
                yield ET.Element("sphere", radius=_text(size[:1])), float(end)


def rpy_from_matrix(R: np.ndarray) -> tuple[float, float, float]:
    """Return (roll, pitch, yaw) [rad] of the rotation matrix R = Rz(yaw) Ry(pitch) Rx(roll) (3, 3).

    yaw is taken first; the other two angles are then read from Rz(-yaw) R, which is a rotation Ry Rx whatever yaw was.
    At pitch = +-pi/2 the first column's horizontal part vanishes and yaw is free: 0 is taken, and roll makes up for it.
    The textbook formula, roll from R's last row, would lose half the digits there; TIAGo's arm_4, arm_5 and arm_6
    placements are at pitch = -pi/2.
    """
    if np.shape(R) != (3, 3):
        raise ValueError(f"a rotation matrix is (3, 3); found {np.shape(R)}")
    horizontal = np.hypot(R[0, 0], R[1, 0])
    yaw = np.arctan2(R[1, 0], R[0, 0]) if horizontal > _NO_YAW else 0.0
    c, s = np.cos(yaw), np.sin(yaw)
    pitch = np.arctan2(-R[2, 0], c * R[0, 0] + s * R[1, 0])
    roll = np.arctan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return float(roll), float(pitch), float(yaw)
