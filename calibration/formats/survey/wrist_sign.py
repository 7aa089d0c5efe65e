"""Whose wrench a wrist's force-torque sensor stores: the weight below it turns with the readings.

    f = s m |g| u + f_0,    u = R_base_sensor' (0, 0, -1)      s = 1: action of the hand on the sensor, -1: its reaction

f_0 is the sensor's zero. The sign of the covariance of f and u is that of s; nothing is stated where they do not follow
one another, as where the sensor's frame in the URDF is not its own, or where the hand hardly turns.
"""

from collections.abc import Iterable

import numpy as np

from calibration.formats.mapping.channels import Recorded
from calibration.robot.chain import chain_of_frames

_FOLLOWS = 0.8  # [-] correlation of the force with the weight's direction
_TURNS = 0.3  # [-] least root mean square by which the weight's direction varies
_SAMPLES = 200  # of a trial


def convention_of(trials: Iterable[Recorded], urdf: str, root: str, link: str) -> str:
    """action or reaction; empty where no recording shows it.

    Args:
        trials: Readings with the sensor's wrench as it is stored.
        urdf: Text of the robot.
        root: Frame with z up.
        link: The sensor's frame.
    """
    f, u = [], []
    for joints in (r.joints for r in trials):
        if joints is None or joints.wrist_wrench is None:
            continue
        known = np.flatnonzero(np.isfinite(joints.wrist_wrench).all(axis=1) & np.isfinite(joints.q_motor).all(axis=1))
        rows = known[:: max(1, len(known) // _SAMPLES)]
        if not len(rows):
            continue
        T = chain_of_frames(urdf, joints.names, root, link).poses(joints.q_motor[rows], link)
        f.append(joints.wrist_wrench[rows, :3])
        u.append(-T[:, 2, :3])
    if not f:
        return ""
    force, down = (x - x.mean(axis=0) for x in (np.concatenate(f), np.concatenate(u)))
    scale = np.sqrt((force**2).sum() * (down**2).sum())
    turned = np.sqrt((down**2).sum(axis=1).mean())
    follows = float((force * down).sum() / scale) if scale > 0.0 and turned > _TURNS else 0.0
    if abs(follows) < _FOLLOWS:
        return ""
    return "action" if follows > 0.0 else "reaction"
