"""Kinematic playback: joints where they are commanded to be, the base on its path, no physics.

The clean form of a campaign. A spin is a turntable with its axis through the base frame's origin, upright; nothing
sags or bends, gears have no backlash, and no wrench is measured. States are those of the set-points.
"""

import mujoco
import numpy as np

from twin.fields.names import BASE
from twin.motions.motion import RATE, Motion
from twin.motions.swings import JOINTS
from twin.simulation.build import Twin
from twin.simulation.states import States
from twin.transforms import rotation_vector
from twin.truth import Parameter, twist_parameters


def kinematic_states(twin: Twin, motion: Motion, T_lab_base: np.ndarray) -> States:
    """States along a motion, at its set-points."""
    q = motion.command
    t = np.arange(len(q)) / RATE
    T = np.tile(np.eye(4), (len(q), 1, 1)) if motion.base is None else motion.base.poses()
    poses = T_lab_base @ T @ np.moveaxis(in_base(twin, q, twin.links), 1, 0)
    return States.zeros(t, q, dict(zip(twin.links, poses, strict=True)))


def in_base(twin: Twin, q: np.ndarray, links: tuple[str, ...]) -> np.ndarray:
    """T_base_link (n, n_links, 4, 4) of the unstrained robot, joints at q (n, 8); rests are computed once."""
    data, T = mujoco.MjData(twin.model), np.tile(np.eye(4), (len(q), len(links) + 1, 1, 1))
    for k, row in enumerate(q):
        if k and (row == q[k - 1]).all():
            T[k] = T[k - 1]
            continue
        for joint, value in zip(JOINTS, row, strict=True):
            data.joint(joint).qpos = value
        mujoco.mj_kinematics(twin.model, data)
        for i, name in enumerate((BASE, *links)):
            body = data.body(name)
            T[k, i, :3, :3], T[k, i, :3, 3] = body.xmat.reshape(3, 3), body.xpos
    return np.linalg.solve(T[:, :1], T[:, 1:])


def arm_frame(twin: Twin, joint: str) -> tuple[Parameter, ...]:
    """`frame.base.arm`: the link of the arm's first joint in the base, every joint at zero, unstrained."""
    T = in_base(twin, np.zeros((1, len(JOINTS))), (joint.replace("_joint", "_link"),))[0, 0]
    return twist_parameters("frame.base.arm", np.concatenate([T[:3, 3], rotation_vector(T)]))
