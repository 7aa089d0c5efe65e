"""Rotations nearest to 3x3 matrices, many at once: those that maximise trace(R' B).

    R = ((k + |B|^2) B + l cof(B) - B B' B) / (k l - det B),     k = (l^2 - |B|^2) / 2
    (l^2 - |B|^2)^2 - 8 l det B - 4 |cof B|^2 = 0                l its largest root, s1 + s2 + sign(det B) s3

(s singular values, |.| Frobenius norms, cof the matrix of cofactors). All roots are real, so that Newton's method falls
monotonically from an upper bound; a matrix of rank 2 is as good as any. Where s2 + sign(det B) s3 is next to zero, many
rotations are as near and the singular value decomposition chooses.
Reference: Markley, Journal of the Astronautical Sciences 1993 (FOAM).
"""

import numpy as np

_STEPS = 100
_STILL = 1e-15  # relative step of the root [-]
_CLEAR = 1e-5  # smallest denominator over l^3 for which rounding does not matter [-]


def nearest_rotations(B: np.ndarray) -> np.ndarray:
    """R (n, 3, 3) with the largest trace(R' B) of matrices B (n, 3, 3)."""
    cofactors = _cofactors(B)
    det, squared = (B[:, 0] * cofactors[:, 0]).sum(axis=1), (B * B).sum(axis=(1, 2))
    with np.errstate(divide="ignore", invalid="ignore"):
        root = _largest_root(det, squared, 4.0 * (cofactors * cofactors).sum(axis=(1, 2)))
        k = 0.5 * (root * root - squared)
        below = k * root - det
        R = (k + squared)[:, None, None] * B + root[:, None, None] * cofactors - B @ (np.swapaxes(B, 1, 2) @ B)
        R /= below[:, None, None]
        R = 1.5 * R - 0.5 * R @ (np.swapaxes(R, 1, 2) @ R)  # orthogonal to the last digit
    clear = below > _CLEAR * root**3
    if not clear.all():
        R[~clear] = _decomposed(B[~clear])
    return R


def _largest_root(det: np.ndarray, squared: np.ndarray, fourth: np.ndarray) -> np.ndarray:
    """Largest root (n,) of (l^2 - squared)^2 - 8 l det - fourth = 0; NaN where all are zero."""
    root, eight = np.sqrt(3.0 * squared), 8.0 * det
    for _ in range(_STEPS):
        m = root * root - squared
        step = (m * m - root * eight - fourth) / (4.0 * root * m - eight)
        root = root - step
        if not (np.abs(step) > _STILL * root).any():
            break
    return root


def _cofactors(B: np.ndarray) -> np.ndarray:
    """cof(B) (n, 3, 3), with B' cof(B) = det(B) I: rows are cross products of the other rows."""
    C = np.empty_like(B)
    for i, j, l in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            C[:, i, a] = B[:, j, b] * B[:, l, c] - B[:, j, c] * B[:, l, b]
    return C


def _decomposed(B: np.ndarray) -> np.ndarray:
    """The same by singular values."""
    U, _, Vt = np.linalg.svd(B)
    U[:, :, 2] *= np.sign(np.linalg.det(U @ Vt))[:, None]
    return np.asarray(U @ Vt)
