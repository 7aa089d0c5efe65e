"""The wrench on the wrist's force-torque sensor, from the motion of the rigid hand behind it and what pushes it.

    F = m (dv_c/dt - g) - f        tau = d(R I R^T w)/dt + c x m (dv_c/dt - g) - r x f      (Newton, Euler)

v_c, w: velocity of the centre of mass c and angular velocity, R = R_lab_sensor, f: a push on the hand at r. The sensor
measures -F, -tau. The change of momentum in a step is exact, whatever the integrator; a force-torque sensor of MuJoCo's
has all accelerations found again, a twentieth of a step, and does not see the push, which is an actuator's there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

WRIST_SENSOR = "wrist_ft_link"
"""The link in whose axes the wrist's force-torque sensor reads."""
WRIST = "wrist"
"""Site of the hand at the sensor's origin, in its axes."""
PUSHED = "push"
"""Site of the hand that a motion may push."""
_HUNG = "wrist_ft_tool_link"  # what hangs on it
_MOVES = (mujoco.mjtSensor.mjSENS_FRAMEQUAT, mujoco.mjtSensor.mjSENS_FRAMELINVEL, mujoco.mjtSensor.mjSENS_FRAMEANGVEL)
_FIELD = mujoco.mjtConDataField
CARRIED = sum(1 << int(f) for f in (_FIELD.mjCONDATA_FORCE, _FIELD.mjCONDATA_TORQUE, _FIELD.mjCONDATA_POS))
NET = 3  # a contact sensor's way to sum up: one force of all contacts


def add_wrist(spec: mujoco.MjSpec) -> None:
    """The wrist's sensor; none on a bench without a wrist."""
    hung = spec.body(_HUNG)
    if hung is None:
        return
    quat, back = np.asarray(hung.quat) * [1.0, -1.0, -1.0, -1.0], np.zeros(3)
    mujoco.mju_rotVecQuat(back, -np.asarray(hung.pos), quat)
    hung.add_site(name=WRIST, pos=back, quat=quat)
    for kind in _MOVES:
        spec.add_sensor(name=f"{WRIST}.{kind.name}", type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=WRIST)


def on_wrist(model: mujoco.MjModel, sensors: np.ndarray, push: np.ndarray) -> np.ndarray:
    """Action of the hand on the wrist's sensor (n, 6), its axes, about its origin [N, N.m]; NaN where there is none.

    `push` (n, 3): force on the hand, its axes [N].
    """
    if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, WRIST) < 0:
        return np.full((len(sensors), 6), np.nan)
    quat, v, w = (sensed(model, sensors, [f"{WRIST}.{kind.name}"]) for kind in _MOVES)
    R = Rotation.from_quat(quat, scalar_first=True).as_matrix()
    carried = RigidBodyInertia.of(model, WRIST).wrench(R, v, w, model.opt.gravity, model.opt.timestep)
    return push_on(model, WRIST, PUSHED, push) - carried


def sensed(model: mujoco.MjModel, sensors: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """Readings of some sensors, side by side (n, k)."""
    found = [model.sensor(name) for name in names]
    return np.hstack([sensors[:, s.adr[0] : s.adr[0] + s.dim[0]] for s in found])


@dataclass(frozen=True)
class RigidBodyInertia:
    """All that hangs on a site, one rigid body, in the site's axes.

    Attributes:
        mass: m [kg].
        centre: c (3,) of mass, from the site [m].
        inertia: I (3, 3) about it [kg.m2].
    """

    mass: float
    centre: np.ndarray
    inertia: np.ndarray

    @classmethod
    def of(cls, model: mujoco.MjModel, site: str) -> "RigidBodyInertia":
        """The body that bears the site, and those below it."""
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_crb(model, data)
        at, body = data.site(site), model.site(site).bodyid[0]
        R, mass = at.xmat.reshape(3, 3), float(model.body_subtreemass[body])
        xx, yy, zz, xy, xz, yz, *moment, _ = data.crb[body]
        d = np.array(moment) / mass
        about_centre = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - mass * (
            d @ d * np.eye(3) - np.outer(d, d)
        )
        return cls(mass, R.T @ (data.subtree_com[body] - at.xpos), R.T @ about_centre @ R)

    def wrench(self, R: np.ndarray, v: np.ndarray, w: np.ndarray, gravity: np.ndarray, step: float) -> np.ndarray:
        """What holds it (n, 6), site axes, about the site [N, N.m].

        Args:
            R: Of the site, at each step (n, 3, 3), site to laboratory.
            v: Its velocity (n, 3), laboratory axes [m/s].
            w: Angular velocity (n, 3), laboratory axes [rad/s].
            gravity: (3,) [m/s2].
            step: [s]; the last takes the change before it.
        """
        a = _rate(v + np.cross(w, R @ self.centre), step) - gravity
        spin = np.einsum("nij,jk,nlk,nl->ni", R, self.inertia, R, w, optimize=True)
        F, M = (np.einsum("nji,nj->ni", R, lab) for lab in (self.mass * a, _rate(spin, step)))
        return np.hstack([F, M + np.cross(self.centre, F)])


def _rate(x: np.ndarray, step: float) -> np.ndarray:
    """From each step to the next (n, 3)."""
    change = np.diff(x, axis=0) / step
    return np.vstack([change, change[-1:]])


def push_on(model: mujoco.MjModel, site: str, pushed: str, force: np.ndarray) -> np.ndarray:
    """Wrench (n, 6) in a site's axes about it of a force (n, 3) in the axes of the site `pushed`, on the same body."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    at, there = data.site(site), data.site(pushed)
    R = at.xmat.reshape(3, 3).T
    f = force @ (R @ there.xmat.reshape(3, 3)).T
    return np.hstack([f, np.cross(R @ (there.xpos - at.xpos), f)])
