"""The correction of a base's position by a force plate: what its reading shows the wheels to have moved.

    dx = g h P (F - sum_i A_i' f_i),    P = (K_t + l K_0)^-1 K_t (K_t + l K_0)^-1

F is its reading of sum_i A_i' f_i, g the rate, K_t the stiffness of the wheels that stick, K_0 that of all: P is K_0^-1
where all stick and 0 where all slide, when the force does not depend on the position and a correction would run away.
"""

import numpy as np

from calibration.numerics.compiled import njit
from calibration.stages.stick_slip.kernel.bases import LANES, STICKS, WHEEL, P


@njit(cache=True, error_model="numpy")
def cofactors(a: np.ndarray) -> tuple[float, float, float, float, float, float, float]:
    """Of a symmetric matrix (a00, a01, a02, a11, a12, a22), and 1 / determinant."""
    c00, c01, c02 = a[3] * a[5] - a[4] * a[4], a[2] * a[4] - a[1] * a[5], a[1] * a[4] - a[2] * a[3]
    c11, c12, c22 = a[0] * a[5] - a[2] * a[2], a[1] * a[2] - a[0] * a[4], a[0] * a[3] - a[1] * a[1]
    return c00, c01, c02, c11, c12, c22, 1.0 / (a[0] * c00 + a[1] * c01 + a[2] * c02)


@njit(cache=True, error_model="numpy")
def solved(a: np.ndarray, b0: float, b1: float, b2: float) -> tuple[float, float, float]:
    """Solution of a symmetric system, a = (a00, a01, a02, a11, a12, a22)."""
    c00, c01, c02, c11, c12, c22, i = cofactors(a)
    return (
        (c00 * b0 + c01 * b1 + c02 * b2) * i,
        (c01 * b0 + c11 * b1 + c12 * b2) * i,
        (c02 * b0 + c12 * b1 + c22 * b2) * i,
    )


@njit(cache=True, error_model="numpy")
def _stiffness(wheels: np.ndarray, o: int, out: np.ndarray) -> None:
    """Add the stiffness of a wheel, from element o of flat wheels on, to (k00, k01, k02, k11, k12, k22)."""
    px, py, kx, ky = wheels[o], wheels[o + LANES], wheels[o + 2 * LANES], wheels[o + 3 * LANES]
    out[0] += kx
    out[2] -= kx * py
    out[3] += ky
    out[4] += ky * px
    out[5] += kx * py * py + ky * px * px


@njit(cache=True, error_model="numpy")
def corrector(wheels: np.ndarray, lane: int, share: float, state: np.ndarray) -> None:
    """P's six elements, row by row, upper, into a lane of a flat state."""
    s, a, sticks = np.zeros(6), np.zeros(6), int(state[STICKS * LANES + lane]) - 1
    for i in range(len(wheels) // (WHEEL * LANES)):
        o = i * WHEEL * LANES + lane
        _stiffness(wheels, o, a)
        if sticks >> i & 1:
            _stiffness(wheels, o, s)
    for k in range(6):
        a[k] = s[k] + share * a[k]
    n = P
    for i in range(3):
        y0, y1, y2 = solved(a, 1.0 * (i == 0), 1.0 * (i == 1), 1.0 * (i == 2))
        z0, z1 = s[0] * y0 + s[1] * y1 + s[2] * y2, s[1] * y0 + s[3] * y1 + s[4] * y2
        z = solved(a, z0, z1, s[2] * y0 + s[4] * y1 + s[5] * y2)
        for j in range(i, 3):
            state[n * LANES + lane] = z[j]
            n += 1
