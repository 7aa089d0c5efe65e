"""Sensors of force in a simulation: the robot's action on the plates and the hand's on the wrist's sensor.

plate:  what its contacts carry, which MuJoCo sums up as a force f at a point p (lab axes):  tau = tau_p + (p - c) x f
wrist:  what holds the hand up, from how it moves and what pushes it
"""

from collections.abc import Sequence

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from twin.hung import Hung, push_on
from twin.instruments.tiles import PLATE

WRIST_SENSOR = "wrist_ft_link"
"""The link in whose axes the wrist's force-torque sensor reads."""

WRIST = "wrist"
"""Site of the hand at the sensor's origin, in its axes."""

PUSHED = "push"
"""Site of the hand that a motion may push."""

_HUNG = "wrist_ft_tool_link"  # what hangs on it
_MOVES = (mujoco.mjtSensor.mjSENS_FRAMEQUAT, mujoco.mjtSensor.mjSENS_FRAMELINVEL, mujoco.mjtSensor.mjSENS_FRAMEANGVEL)
_FIELD = mujoco.mjtConDataField
_CARRIED = sum(1 << int(f) for f in (_FIELD.mjCONDATA_FORCE, _FIELD.mjCONDATA_TORQUE, _FIELD.mjCONDATA_POS))
_NET = 3  # a contact sensor's way to sum up: one force of all contacts


def add_plates(spec: mujoco.MjSpec) -> None:
    """A sensor on each body that bears a plate's site: the plate, and the parts of one that is cut in several."""
    for site in spec.sites:
        if site.name.startswith(PLATE):
            spec.add_sensor(
                name=site.name,
                type=mujoco.mjtSensor.mjSENS_CONTACT,
                objtype=mujoco.mjtObj.mjOBJ_XBODY,
                objname=site.parent.name,
                intprm=[_CARRIED, _NET, 1],
            )


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


def on_plate(model: mujoco.MjModel, sensors: np.ndarray, plate: str) -> np.ndarray:
    """Action on a plate (n, 6) of the readings of all sensors (n, ns): lab axes, about its centre [N, N.m]."""
    force, torque, point = np.split(sensed(model, sensors, (plate,)), 3, axis=1)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return -np.hstack([force, torque + np.cross(point - data.site(plate).xpos, force)])


def on_wrist(model: mujoco.MjModel, sensors: np.ndarray, push: np.ndarray) -> np.ndarray:
    """Action of the hand on the wrist's sensor (n, 6), its axes, about its origin [N, N.m]; NaN where there is none.

    `push` (n, 3): force on the hand, its axes [N].
    """
    if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, WRIST) < 0:
        return np.full((len(sensors), 6), np.nan)
    quat, v, w = (sensed(model, sensors, [f"{WRIST}.{kind.name}"]) for kind in _MOVES)
    R = Rotation.from_quat(quat, scalar_first=True).as_matrix()
    held = Hung.of(model, WRIST).wrench(R, v, w, model.opt.gravity, model.opt.timestep)
    return push_on(model, WRIST, PUSHED, push) - held


def sensed(model: mujoco.MjModel, sensors: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """Readings of some sensors, side by side (n, k)."""
    found = [model.sensor(name) for name in names]
    return np.hstack([sensors[:, s.adr[0] : s.adr[0] + s.dim[0]] for s in found])
