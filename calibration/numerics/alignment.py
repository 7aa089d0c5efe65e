"""Where the laboratory and the hand's marker body are, in closed form, nominal geometry.

    p_i + R_i t = X y_i + x         i = 1..n postures

(R_i, p_i) is the tool's nominal pose, y_i the measured origin of the hand's body, t its place in the tool, (X, x) the
laboratory in the robot's base: linear in all 15 unknowns while X is any matrix. Its determinant is the cube of the
scale between robot and laboratory and shows wrong units and mirrored axes; its nearest rotation is the start of a fit.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from calibration.errors import NotEnoughData
from calibration.numerics.compiled import njit
from calibration.numerics.lie import compose, inverse, mean, rotation_vector, to_vector

_MANY = 100  # postures that are enough for a start
_ROUNDS = 8  # of weighing by the inverse of the distance left: the sum of distances is minimised, not of squares
_FLAT = 1e-12  # eigenvalues of the normal equations below this share of the largest are zero [-]
_TRIMMED = 4.0  # distances beyond this many medians are left out in the end
_TURNED = 1e-3  # second singular value of the arm's turns over the first, below which they share one axis [-]
_ODD = 3.0  # times the median distance left, beyond which a posture is wrong
_FEWEST = 4  # postures
_BELOW_PI = 2.8  # [rad] a rotation vector near pi may turn its sign
_SWEEPS, _SMALL = 20, 1e-31  # of Jacobi's method; squares of what is off the diagonal over those on it


@dataclass(frozen=True)
class Start:
    """Frames to start from.

    Attributes:
        frames: (12,) T_base_B and T_tool_H as translation and rotation vector [m, rad].
        scale: Size of the robot over that of the laboratory, negative where one is mirrored [-].
        residual: Distance left at each posture asked [m].
    """

    frames: np.ndarray
    scale: float
    residual: np.ndarray


def registration_start(T_tool: np.ndarray, T_lab_hand: np.ndarray, oriented: bool) -> Start:
    """Start values from nominal tool poses (n, 4, 4) and measured hand poses (n, 4, 4), oriented or positions only."""
    some = np.unique(np.linspace(0, len(T_tool) - 1, _MANY).astype(int))
    T_tool, T_lab_hand = T_tool[some], T_lab_hand[some]
    y, n = T_lab_hand[:, :3, 3], len(T_tool)
    blocks = [T_tool[:, :3, :3], -np.einsum("ab,nc->nabc", np.eye(3), y).reshape(n, 3, 9)]
    A = np.concatenate([*blocks, np.broadcast_to(-np.eye(3), (n, 3, 3))], axis=2)
    b, w = -T_tool[:, :3, 3], np.ones(n)
    squares = (np.swapaxes(A, 1, 2) @ np.concatenate([A, b[..., None]], axis=2)).reshape(n, 240)
    for _ in range(_ROUNDS):
        normal = (w**2 @ squares).reshape(15, 16)
        x = np.linalg.pinv(normal[:, :15], rcond=_FLAT, hermitian=True) @ normal[:, 15]
        residual = np.linalg.norm(A @ x - b, axis=1)
        w = 1.0 / np.sqrt(np.maximum(residual, max(0.1 * np.median(residual), 1e-12)))
    rows = residual <= _TRIMMED * max(np.median(residual), 1e-12)
    X = x[3:12].reshape(3, 3)
    det = float(np.linalg.det(X))
    R = nearest_rotations(X[None])[0]
    # With the rotation known, the two translations are linear.
    C = np.concatenate([T_tool[:, :3, :3], np.broadcast_to(-np.eye(3), (n, 3, 3))], axis=2)
    e = y @ R.T + b
    t = np.linalg.lstsq(C[rows].reshape(-1, 6), e[rows].ravel(), rcond=1e-9)[0]
    T_base_lab = compose(R, t[3:])
    T_tool_hand = np.eye(4)
    if oriented:
        T_tool_hand = mean((inverse(T_tool) @ T_base_lab @ T_lab_hand)[rows])
    T_tool_hand[:3, 3] = t[:3]
    frames = np.concatenate([to_vector(T_base_lab), to_vector(T_tool_hand)])
    return Start(frames, float(np.cbrt(det)), np.linalg.norm(C @ t - e, axis=1))


def nearest_rotations(B: np.ndarray) -> np.ndarray:
    """R (n, 3, 3) with the largest trace(R' B) of matrices B (n, 3, 3).

    Its quaternion is the eigenvector of the largest eigenvalue of a symmetric matrix of B's sums and differences.
    Reference: Horn, J. Opt. Soc. Am. A 4 (1987).
    """
    return np.asarray(_turned(np.ascontiguousarray(B, dtype=float)))


@njit(cache=True, error_model="numpy")
def _turned(B: np.ndarray) -> np.ndarray:
    """`nearest_rotations`, by Jacobi's rotations."""
    R, N, V = np.empty_like(B), np.empty((4, 4)), np.empty((4, 4))
    for k in range(len(B)):
        b = B[k]
        N[0, 0] = b[0, 0] + b[1, 1] + b[2, 2]
        for i in range(3):
            m, n = (i + 1) % 3, (i + 2) % 3
            N[0, 1 + i] = b[n, m] - b[m, n]
            N[1 + i, 1 + i] = 2.0 * b[i, i] - N[0, 0]
            for j in range(i + 1, 3):
                N[1 + i, 1 + j] = b[i, j] + b[j, i]
        for i in range(4):
            for j in range(4):
                V[i, j] = 1.0 * (i == j)
        _diagonalised(N, V)
        best = 0
        for i in range(1, 4):
            best = i if N[i, i] > N[best, best] else best
        w, x, y, z = V[0, best], V[1, best], V[2, best], V[3, best]
        R[k, 0, 0], R[k, 0, 1], R[k, 0, 2] = w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)
        R[k, 1, 0], R[k, 1, 1], R[k, 1, 2] = 2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)
        R[k, 2, 0], R[k, 2, 1], R[k, 2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z
    return R


@njit(cache=True, error_model="numpy")
def _diagonalised(N: np.ndarray, V: np.ndarray) -> None:
    """Turn the axes of symmetric N (4, 4), its upper half, until it is diagonal; V's columns turn with them."""
    for _ in range(_SWEEPS):
        off, size = 0.0, 0.0
        for i in range(4):
            size += N[i, i] ** 2
            for j in range(i + 1, 4):
                off += N[i, j] ** 2
        if not off > _SMALL * size:
            return
        for i in range(3):
            for j in range(i + 1, 4):
                if N[i, j] == 0.0:
                    continue
                ratio = (N[j, j] - N[i, i]) / (2.0 * N[i, j])
                t = 1.0 / (abs(ratio) + np.sqrt(1.0 + ratio * ratio))
                t = t if ratio >= 0.0 else -t
                c = 1.0 / np.sqrt(1.0 + t * t)
                s = t * c
                N[i, i] -= t * N[i, j]
                N[j, j] += t * N[i, j]
                N[i, j] = 0.0
                for r in range(4):
                    if r != i and r != j:
                        a, b = min(r, i), max(r, i)
                        d, e = min(r, j), max(r, j)
                        x, y = N[a, b], N[d, e]
                        N[a, b], N[d, e] = c * x - s * y, s * x + c * y
                    x, y = V[r, i], V[r, j]
                    V[r, i], V[r, j] = c * x - s * y, s * x + c * y


def start(M: np.ndarray, A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """X and Y in closed form, from nothing.

    Raises:
        NotEnoughData: The arm turns about one axis only.
    """
    a, b = (rotation_vector(T[1:, :3, :3] @ np.swapaxes(T[:-1, :3, :3], 1, 2)) for T in (M, A))
    turns = np.linalg.svd(b, compute_uv=False)
    if len(M) < 3 or turns[1] < _TURNED * turns[0]:
        raise NotEnoughData(
            f"{len(M)} postures turn the arm about one axis only; a turn of arm base "
            "and tool about it cannot be determined apart"
        )
    R_X = nearest_rotations((a.T @ b)[None])[0]
    R_Y = Rotation.from_matrix(np.swapaxes(R_X @ A[:, :3, :3], 1, 2) @ M[:, :3, :3]).mean().as_matrix()
    return _with_translations(R_X, R_Y, A, M)


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
    clear = np.linalg.norm(turns[0], axis=1) < _BELOW_PI
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
