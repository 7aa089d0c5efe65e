"""The only place that converts between MuJoCo's conventions and the project's.

MuJoCo: quaternions w x y z; placements as position and quaternion; a sensor value computed in step k belongs to the
state before that step. The project: T_a_b as 4x4 matrices, twists linear then angular, values when they were true.
"""

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation


def transform(position: np.ndarray, quat_wxyz: np.ndarray) -> np.ndarray:
    """T (..., 4, 4) from positions (..., 3) [m] and MuJoCo quaternions (..., 4)."""
    T = np.zeros((*np.shape(position)[:-1], 4, 4))
    T[..., :3, :3] = Rotation.from_quat(quat_wxyz, scalar_first=True).as_matrix()
    T[..., :3, 3], T[..., 3, 3] = position, 1.0
    return T


def placement(T: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) [m] and MuJoCo quaternion w x y z (4,) of one transform (4, 4)."""
    return T[:3, 3].copy(), Rotation.from_matrix(T[:3, :3]).as_quat(canonical=True, scalar_first=True)


def exp6(twist: np.ndarray) -> np.ndarray:
    """T = exp of twists (..., 6), linear [m] then angular [rad], as (..., 4, 4)."""
    twist = np.asarray(twist, dtype=float)
    return RigidTransform.from_exp_coords(np.concatenate([twist[..., 3:], twist[..., :3]], axis=-1)).as_matrix()


def rotation_vector(T: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3) [rad] of transforms (..., 4, 4)."""
    return Rotation.from_matrix(T[..., :3, :3]).as_rotvec()


def states_with_their_sensors(first: np.ndarray, states: np.ndarray) -> np.ndarray:
    """States (n, ns) on which the sensor values (n, ...) of the same n steps were computed.

    A rollout returns the state AFTER each step beside sensor values computed BEFORE it; taken as one row they would
    be a step apart (0.5 mm at 0.8 m/s and 1 ms).
    """
    return np.concatenate([first[None], states[:-1]])
