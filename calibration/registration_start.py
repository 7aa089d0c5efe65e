"""Where the laboratory and the hand's marker body are, in closed form, nominal geometry.

    p_i + R_i t = X y_i + x         i = 1..n postures

(R_i, p_i) is the tool's nominal pose, y_i the measured origin of the hand's body, t its place in the tool, (X, x) the
laboratory in the robot's base: linear in all 15 unknowns while X is any matrix. Its determinant is the cube of the
scale between robot and laboratory and tells wrong units and mirrored axes; its nearest rotation is the start of a fit.
"""

from dataclasses import dataclass

import numpy as np

from calibration.se3 import compose, inverse, mean, to_vector

_MANY = 100  # postures that are enough for a start
_ROUNDS = 8  # of weighing by the inverse of the distance left: the sum of distances is minimised, not of squares
_FLAT = 1e-12  # eigenvalues of the normal equations below this share of the largest are zero [-]
_TRIMMED = 4.0  # distances beyond this many medians are left out in the end


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
    U, _, Vt = np.linalg.svd(X)
    R = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
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
