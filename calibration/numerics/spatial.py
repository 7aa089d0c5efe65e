"""Products of vectors that lie in the rows of a table, compiled: what kernels over trees of bodies are made of.

A vector x[a, i:i + 3] is named by its row and its first column: a slice would be counted as a reference, which takes
longer than the product.
"""

import numpy as np

from calibration.numerics.compiled import njit


@njit(cache=True, error_model="numpy")
def cross(x: np.ndarray, a: int, i: int, b: int, j: int, c: int, k: int) -> None:
    """Add x[a, i:i + 3] x x[b, j:j + 3] to x[c, k:k + 3]."""
    for r in range(3):
        s, t = (r + 1) % 3, (r + 2) % 3
        x[c, k + r] += x[a, i + s] * x[b, j + t] - x[a, i + t] * x[b, j + s]


@njit(cache=True, error_model="numpy")
def turned(x: np.ndarray, b: int, a: int, i: int, k: int) -> None:
    """Add R x[a, i:i + 3] to x[a, k:k + 3], R the orientation (3, 3) with which row b begins, row by row."""
    u, v, w = x[a, i], x[a, i + 1], x[a, i + 2]
    for r in range(3):
        x[a, k + r] = x[a, k + r] + x[b, 3 * r] * u + x[b, 3 * r + 1] * v + x[b, 3 * r + 2] * w


@njit(cache=True, error_model="numpy")
def dot(x: np.ndarray, a: int, i: int, b: int, j: int) -> float:
    """Power of a twist x[a, i:i + 6] and a wrench x[b, j:j + 6]."""
    total = 0.0
    for c in range(6):
        total += x[a, i + c] * x[b, j + c]
    return total
