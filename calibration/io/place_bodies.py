"""Where markers sit that nobody measured: their shape from the recording, their place by the base or the nominal robot.

    shape      mean over all samples of the cluster that have one shape, see marker_shape
    standing   x_m = T_lab_base^-1 p_m, the base frame declared to stand at (x, y, heading) in the first second
    fitted     B_i = X A_i Y     A_i nominal T_base_hand(q_i), B_i measured; closed form: for all pairs of postures
               log(A_i^-1 A_j) = R_Y log(B_i^-1 B_j), R_X by the mean, then both translations linearly

X places the frame of the marker positions on the base, Y the cluster on its link. Both are only starting points: the
stages fit them again, with the tolerances the setup declares.
Reference: Park, Martin, IEEE Trans. Robotics and Automation 1994 (hand-eye calibration on the Euclidean group).
"""

import numpy as np
from scipy.spatial.transform import Rotation

from calibration.errors import NotEnoughData
from calibration.marker_shape import cluster
from calibration.se3 import compose, inverse, mean, rotation_vector

_ODD = 3.0  # times the median distance left, beyond which a posture is wrong
_FEWEST = 4  # postures
_CLEAR = 2.8  # [rad] a rotation vector near pi may turn its sign


def mean_shape(positions: np.ndarray) -> np.ndarray:
    """Shape (m, 3) [m] of a cluster from positions (n, m, 3), about its centre; NaN positions are left out.

    Raises:
        NotEnoughData: No sample shows all markers.
    """
    whole = positions[np.isfinite(positions).all(axis=(1, 2))]
    if not len(whole):
        raise NotEnoughData("no sample shows all of its markers together, so its shape is not known")
    if whole.shape[1] == 1:
        return np.zeros((1, 3))
    if whole.shape[1] == 2:
        raise NotEnoughData("two markers show no frame of a body: give one of them alone, three, or both drawn")
    shape = cluster(whole).xyz
    return np.asarray(shape - shape.mean(axis=0))


def standing_shape(positions: np.ndarray, x: float, y: float, heading: float) -> np.ndarray:
    """Marker coordinates (m, 3) [m, base] from positions at rest (n, m, 3) [m, lab] of a base that stands upright."""
    T = compose(Rotation.from_rotvec([0.0, 0.0, heading]).as_matrix(), np.array([x, y, 0.0]))
    at_rest = np.nanmean(positions, axis=0)
    return (at_rest - T[:3, 3]) @ T[:3, :3]


def hand_eye(A: np.ndarray, B: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """X, Y (4, 4) with B_i = X A_i Y in the least-squares sense, for poses A, B (n, 4, 4), wrong ones left out.

    Raises:
        NotEnoughData: Too few postures, or all turned about one direction.
    """
    good = np.isfinite(A).all(axis=(1, 2)) & np.isfinite(B).all(axis=(1, 2))
    A, B = A[good], B[good]
    if len(A) < _FEWEST or _spread(A) < 1e-3:
        raise NotEnoughData(f"{len(A)} postures do not turn the hand enough to place its markers; record more")
    X, Y = _hand_eye(A, B)
    off = np.linalg.norm((X @ A @ Y)[:, :3, 3] - B[:, :3, 3], axis=1)
    near = off <= _ODD * np.median(off)
    return (X, Y) if near.all() else _hand_eye(A[near], B[near])


def _hand_eye(A: np.ndarray, B: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    i, j = np.triu_indices(len(A), 1)
    turns = [rotation_vector(np.swapaxes(T[i, :3, :3], 1, 2) @ T[j, :3, :3]) for T in (A, B)]
    clear = np.linalg.norm(turns[0], axis=1) < _CLEAR
    R_Y = Rotation.align_vectors(turns[0][clear], turns[1][clear])[0].as_matrix()
    R_X = Rotation.from_matrix(B[:, :3, :3] @ R_Y.T @ np.swapaxes(A[:, :3, :3], 1, 2)).mean().as_matrix()
    return _with_translations(R_X, R_Y, A, B)


def _with_translations(R_X: np.ndarray, R_Y: np.ndarray, A: np.ndarray, B: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """t_X + R_X R_A t_Y = t_B - R_X t_A, six unknowns."""
    left = np.concatenate([np.broadcast_to(np.eye(3), (len(A), 3, 3)), R_X @ A[:, :3, :3]], axis=2)
    right = B[:, :3, 3] - A[:, :3, 3] @ R_X.T
    t = np.linalg.lstsq(left.reshape(-1, 6), right.ravel(), rcond=None)[0]
    return compose(R_X, t[:3]), compose(R_Y, t[3:])


def _spread(A: np.ndarray) -> float:
    """Second largest variance of the rotation vectors about their mean [rad2]."""
    turns = Rotation.from_matrix((inverse(mean(A)[None]) @ A)[:, :3, :3]).as_rotvec()
    return float(np.sort(np.linalg.eigvalsh(np.cov(turns.T)))[-2])
