"""Products of vectors that lie in longer arrays, compiled: what kernels over trees of bodies are made of."""

import numpy as np

from calibration.numerics.compiled import njit


@njit(cache=True, error_model="numpy")
def cross(x: np.ndarray, i: int, y: np.ndarray, j: int, out: np.ndarray, at: int) -> None:
    """Add x[i:i + 3] x y[j:j + 3] to out[at:at + 3]."""
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        out[at + a] += x[i + b] * y[j + c] - x[i + c] * y[j + b]


@njit(cache=True, error_model="numpy")
def turned(me: np.ndarray, x: np.ndarray, out: np.ndarray, at: int) -> None:
    """Add R x to out[at:at + 3], R the orientation (3, 3) with which me begins, row by row."""
    for i in range(3):
        for c in range(3):
            out[at + i] += me[3 * i + c] * x[c]


@njit(cache=True, error_model="numpy")
def dot(x: np.ndarray, i: int, y: np.ndarray, j: int) -> float:
    """Power of a twist x[i:i + 6] and a wrench y[j:j + 6]."""
    total = 0.0
    for c in range(6):
        total += x[i + c] * y[j + c]
    return total
