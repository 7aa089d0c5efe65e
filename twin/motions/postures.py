"""Static postures for calibration: reachable, clear of the robot's own body, hand cluster in the cameras' sight.

Cameras look down from around the robot: the hand's upper side, its -z, must face upwards within 78 deg.

Drawn by rejection inside the joint limits and ordered into a short tour.
"""

import mujoco
import numpy as np

from twin.errors import Unreachable
from twin.motions.swings import JOINTS

_MARGIN = 0.10  # [rad, half in m for the torso] inside the hard limits
_CHECKED = ("arm_4_link", "arm_5_link", "arm_6_link", "gripper_link", "gripper_grasping_frame")
_UPWARDS = 0.2  # [-] least cosine between the hand's upper side and the vertical
_ATTEMPTS = 1000  # per posture asked for


def sample_postures(model: mujoco.MjModel, n: int, rng: np.random.Generator) -> np.ndarray:
    """Postures (n, 8) of the measured joints, in the order of `JOINTS` [m, rad].

    Raises:
        Unreachable: The robot has no such many admissible postures.
    """
    limits = np.array([model.joint(j).range for j in JOINTS])
    margin = np.array([0.02, *np.full(len(JOINTS) - 1, _MARGIN)])
    low, high = limits[:, 0] + margin, limits[:, 1] - margin
    data, found = mujoco.MjData(model), []
    for q in rng.uniform(low, high, size=(_ATTEMPTS * n, len(JOINTS))):
        if _admissible(model, data, q):
            found.append(q)
        if len(found) == n:
            return tour(np.array(found))
    raise Unreachable(f"found {len(found)} of {n} postures inside the limits and clear of the body; ask for fewer")


def _admissible(model: mujoco.MjModel, data: mujoco.MjData, q: np.ndarray) -> bool:
    """Every checked link clear of the base (a cylinder), the torso (a column) and the floor; the hand in sight."""
    for name, value in zip(JOINTS, q, strict=True):
        data.joint(name).qpos = value
    mujoco.mj_kinematics(model, data)
    base = data.body("base_footprint")
    R = base.xmat.reshape(3, 3)
    p = np.array([R.T @ (data.body(n).xpos - base.xpos) for n in _CHECKED])
    clear_of_base = np.all((np.hypot(p[:, 0], p[:, 1]) > 0.42) | (p[:, 2] > 0.50))
    clear_of_torso = np.all(np.hypot(p[:, 0] + 0.05, p[:, 1]) > 0.36)
    hand = p[-1]
    in_sight = hand[0] > 0.15 and 0.35 < hand[2] < 1.5 and np.hypot(hand[0], hand[1]) > 0.45
    upwards = -data.body(_CHECKED[-1]).xmat[8] > _UPWARDS
    return bool(clear_of_base and clear_of_torso and in_sight and upwards and np.all(p[:, 2] > 0.30))


def tour(q: np.ndarray) -> np.ndarray:
    """The same postures (n, m), each followed by the nearest one left, in the largest joint step."""
    order, left = [0], set(range(1, len(q)))
    while left:
        here = q[order[-1]]
        order.append(min(left, key=lambda i: (float(np.abs(q[i] - here).max()), i)))
        left.remove(order[-1])
    return q[order]
