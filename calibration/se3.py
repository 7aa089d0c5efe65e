"""Rigid transforms as arrays, time or posture first.

T is (n, 4, 4), a twist (n, 6) is linear then angular, local: T exp6(xi) perturbs on the right.

    T_a_c = T_a_b T_b_c
    Ad(T) = [[R, [p]x R], [0, R]]       maps a twist of b in a when T = T_a_b
"""

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation


def inverse(T: np.ndarray) -> np.ndarray:
    """T_b_a of T_a_b, (..., 4, 4)."""
    R_t = np.swapaxes(T[..., :3, :3], -1, -2)
    return compose(R_t, -(R_t @ T[..., :3, 3:])[..., 0])


def compose(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Homogeneous transforms of rotations (..., 3, 3) and translations (..., 3) [m]."""
    T = np.zeros((*R.shape[:-2], 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, p, 1.0
    return T


def from_vector(value: np.ndarray) -> np.ndarray:
    """Transforms (..., 4, 4) whose translation [m] and rotation vector [rad] are `value` (..., 6), one axis at most."""
    return compose(Rotation.from_rotvec(value[..., 3:]).as_matrix(), value[..., :3])


def to_vector(T: np.ndarray) -> np.ndarray:
    """Translation [m] and rotation vector [rad] of T, (..., 6)."""
    return np.concatenate([T[..., :3, 3], rotation_vector(T[..., :3, :3])], axis=-1)


def rotation_vector(R: np.ndarray) -> np.ndarray:
    """log3 of rotations (..., 3, 3), (..., 3) [rad]; NaN where R is NaN."""
    flat = R.reshape(-1, 3, 3)
    finite = np.isfinite(flat).all(axis=(1, 2))
    out = np.full((len(flat), 3), np.nan)
    if finite.any():
        out[finite] = Rotation.from_matrix(flat[finite]).as_rotvec()
    return out.reshape(*R.shape[:-2], 3)


def skew(v: np.ndarray) -> np.ndarray:
    """[v]x of vectors (..., 3): [v]x w = v x w."""
    S = np.zeros((*v.shape[:-1], 3, 3))
    S[..., 0, 1], S[..., 0, 2], S[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return S - np.swapaxes(S, -1, -2)


def adjoint(T: np.ndarray) -> np.ndarray:
    """Ad(T), (..., 6, 6): twist in b -> twist in a for T = T_a_b."""
    R, p = T[..., :3, :3], T[..., :3, 3]
    Ad = np.zeros((*T.shape[:-2], 6, 6))
    Ad[..., :3, :3] = Ad[..., 3:, 3:] = R
    Ad[..., :3, 3:] = skew(p) @ R
    return Ad


def mean(T: np.ndarray) -> np.ndarray:
    """Mean pose (4, 4) of poses close to each other (n, 4, 4), samples with NaN left out."""
    T = T[np.isfinite(T).all(axis=(1, 2))]
    return compose(Rotation.from_matrix(T[:, :3, :3]).mean().as_matrix(), T[:, :3, 3].mean(axis=0))


def local_twist(vector: np.ndarray) -> np.ndarray:
    """L (6, 6): change of translation and rotation vector -> local twist of that frame."""
    L = np.zeros((6, 6))
    L[:3, :3], L[3:, 3:] = pin.exp3(vector[3:]).T, pin.Jexp3(vector[3:])
    return L
