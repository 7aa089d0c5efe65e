"""URDF roll, pitch, yaw of a rotation matrix, exact at pitch = +-pi/2 too.

    R = Rz(yaw) Ry(pitch) Rx(roll)        fixed axes x, y, z in this order

yaw is taken first; the other two angles are then read from Rz(-yaw) R, which is a rotation Ry Rx whatever yaw was.
At pitch = +-pi/2 the first column's horizontal part vanishes and yaw is free: 0 is taken, and roll makes up for it.
The textbook formula, roll from R's last row, would lose half the digits there; TIAGo's arm_4, arm_5 and arm_6
placements are at pitch = -pi/2.
"""

import numpy as np

_NO_YAW = 8.0 * np.finfo(float).eps


def rpy_from_matrix(R: np.ndarray) -> tuple[float, float, float]:
    """Return (roll, pitch, yaw) [rad] of the rotation matrix `R` (3, 3)."""
    if np.shape(R) != (3, 3):
        raise ValueError(f"a rotation matrix is (3, 3); found {np.shape(R)}")
    horizontal = np.hypot(R[0, 0], R[1, 0])
    yaw = np.arctan2(R[1, 0], R[0, 0]) if horizontal > _NO_YAW else 0.0
    c, s = np.cos(yaw), np.sin(yaw)
    pitch = np.arctan2(-R[2, 0], c * R[0, 0] + s * R[1, 0])
    roll = np.arctan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return float(roll), float(pitch), float(yaw)


def matrix_from_rpy(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return the rotation matrix (3, 3) of URDF angles [rad]."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
