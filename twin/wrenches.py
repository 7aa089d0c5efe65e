"""Sensors of force in a simulation: the robot's action on the plates and the hand's on the wrist's sensor.

plate:  what its contacts carry, which MuJoCo sums up as a force f at a point p (lab axes):  tau = tau_p + (p - c) x f
wrist:  what holds the hand up, from the accelerations of all that hangs on it; dear, so only where somebody reads it
"""

from collections.abc import Sequence

import mujoco
import numpy as np

from twin.instruments.tiles import PLATE

WRIST_SENSOR = "wrist_ft_link"
"""The link in whose axes the wrist's force-torque sensor reads."""

_HUNG = "wrist_ft_tool_link"  # what hangs on it
_WRIST = "wrist"
_HELD = (mujoco.mjtSensor.mjSENS_FORCE, mujoco.mjtSensor.mjSENS_TORQUE)
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
    hung.add_site(name=_WRIST, pos=back, quat=quat)
    for kind in _HELD:
        spec.add_sensor(name=f"{_WRIST}.{kind.name}", type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=_WRIST)


def on_plate(model: mujoco.MjModel, sensors: np.ndarray, plate: str) -> np.ndarray:
    """Action on a plate (n, 6) of the readings of all sensors (n, ns): lab axes, about its centre [N, N.m]."""
    force, torque, point = np.split(sensed(model, sensors, (plate,)), 3, axis=1)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return -np.hstack([force, torque + np.cross(point - data.site(plate).xpos, force)])


def on_wrist(model: mujoco.MjModel, sensors: np.ndarray) -> np.ndarray:
    """Action of the hand on the wrist's sensor (n, 6), its axes, about its origin [N, N.m]; NaN where there is none."""
    there = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, _WRIST) >= 0
    if not there:
        return np.full((len(sensors), 6), np.nan)
    return -sensed(model, sensors, [f"{_WRIST}.{kind.name}" for kind in _HELD])


def sensed(model: mujoco.MjModel, sensors: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """Readings of some sensors, side by side (n, k)."""
    found = [model.sensor(name) for name in names]
    return np.hstack([sensors[:, s.adr[0] : s.adr[0] + s.dim[0]] for s in found])
