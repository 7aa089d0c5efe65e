"""What the wrist's force-torque sensor holds: a rigid hand, and the wrench that its motion asks for.

    F = m (dv_c/dt - g) - f        tau = d(R I R^T w)/dt + c x m (dv_c/dt - g) - r x f      (Newton, Euler)

v_c, w: velocity of the centre of mass c and angular velocity, R = R_lab_sensor, f: a push on the hand at r. The sensor
feels -F, -tau. The change of momentum in a step is exact, whatever the integrator; a force-torque sensor of MuJoCo's
has all accelerations found again, a twentieth of a step, and does not see the push, which is an actuator's there.
"""

from dataclasses import dataclass

import mujoco
import numpy as np


@dataclass(frozen=True)
class Hung:
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
    def of(cls, model: mujoco.MjModel, site: str) -> "Hung":
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
