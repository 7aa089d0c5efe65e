"""The base joint of a model: free, or the six joints of `twin.defects.wheels.anchored_base`.

anchored:  T_lab_base = T_0 R_x(theta_x) R_y(theta_y) R_z(theta_z) Trans(s),     T_0 where it was placed
"""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from twin.defects.wheels.anchored_base import AXES
from twin.fields.names import BASE
from twin.transforms import placement, transform

ROOT = BASE


def anchored(model: mujoco.MjModel) -> bool:
    """Whether the base hangs on springs in the floor."""
    return int(model.jnt_type[model.body(ROOT).jntadr[0]]) != mujoco.mjtJoint.mjJNT_FREE


def place_base(model: mujoco.MjModel, T_lab_base: np.ndarray) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A robot standing upright at T_lab_base (4, 4); the model is a copy where the place is part of it."""
    position, quat = placement(T_lab_base)
    if not anchored(model):
        data = mujoco.MjData(model)
        data.joint("root").qpos[:3], data.joint("root").qpos[3:] = position, quat
        return model, data
    model = model.__copy__()
    base = model.body(ROOT).id
    model.body_pos[base], model.body_quat[base] = position, quat
    return model, mujoco.MjData(model)


def base_poses(model: mujoco.MjModel, qpos: np.ndarray) -> np.ndarray:
    """T_lab_base (n, 4, 4) of states qpos (n, nq)."""
    if not anchored(model):
        start = model.joint("root").qposadr[0]
        return transform(qpos[:, start : start + 3], qpos[:, start + 3 : start + 7])
    x = qpos[:, [model.joint(f"root.{a}").qposadr[0] for a in AXES]]
    R = Rotation.from_euler("XYZ", x[:, 3:])
    base = model.body(ROOT)
    T_turned = transform(R.apply(x[:, :3]), R.as_quat(scalar_first=True))
    return np.asarray(transform(base.pos, base.quat) @ T_turned)


def base_velocities(model: mujoco.MjModel, qvel: np.ndarray) -> np.ndarray:
    """Speeds (n, 6) of the base's joints, linear then angular [m/s, rad/s], of states qvel (n, nv)."""
    if anchored(model):
        return np.asarray(qvel[:, [model.joint(f"root.{a}").dofadr[0] for a in AXES]])
    start = model.joint("root").dofadr[0]
    return np.asarray(qvel[:, start : start + 6])


def floor_wrench(model: mujoco.MjModel, qpos: np.ndarray, qvel: np.ndarray, about: np.ndarray) -> np.ndarray:
    """Action of anchored wheels on the floor (n, 6), lab axes, about a point (3,) of the lab [N, N.m].

    The hinges' torques are the moment's components along their axes, which turn one with the other.
    """
    x = qpos[:, [model.joint(f"root.{a}").qposadr[0] for a in AXES]]
    v = base_velocities(model, qvel)
    K, C = (_matrix(model, kind) for kind in ("spring", "damper"))
    f = x @ K.T + v @ C.T
    R_x, R_xy = Rotation.from_euler("X", x[:, 3:4]), Rotation.from_euler("XY", x[:, 3:5])
    axes = np.stack([np.tile([1.0, 0.0, 0.0], (len(x), 1)), R_x.apply([0.0, 1.0, 0.0]), R_xy.apply([0.0, 0.0, 1.0])], 1)
    moment = np.linalg.solve(axes, f[:, 3:, None])[..., 0]
    base = model.body(ROOT)
    R_lab_0 = Rotation.from_quat(base.quat, scalar_first=True)
    force = (R_lab_0 * Rotation.from_euler("XYZ", x[:, 3:])).apply(f[:, :3])
    return np.hstack([force, R_lab_0.apply(moment) + np.cross(base.pos - about, force)])


def _matrix(model: mujoco.MjModel, kind: str) -> np.ndarray:
    """K or C (6, 6) of the model's tendons."""
    found = np.zeros((6, 6))
    for n in range(6):
        i = model.tendon(f"root.{kind}.{n}").id
        value = float((model.tendon_stiffness if kind == "spring" else model.tendon_damping)[i])
        rows = slice(model.tendon_adr[i], model.tendon_adr[i] + model.tendon_num[i])
        joints, share = model.wrap_objid[rows], model.wrap_prm[rows]
        e = np.zeros(6)
        e[[AXES.index(model.joint(int(j)).name.removeprefix("root.")) for j in joints]] = share
        found += value * np.outer(e, e)
    return found
