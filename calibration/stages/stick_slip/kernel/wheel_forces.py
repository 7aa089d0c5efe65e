"""Forces of wheels side by side: as if all stuck, then those are let slide whose friction does not bear them.

    g = K e + C de/dt + (N - m G) (-ry, rx),   f' = g + m / h u,   f = f' min(mu N / |f'|, 1)
    u <- (f' - f) / (K h + C + m / h),    e <- e - h u,    W <- W + A' m / h (u - u_before)

of one wheel, see `integration`: f' bears what a wheel that slid loses when it stops; K in the denominator is what the
spring gives way in the step. Few wheels slide at a time, and only those need a root and a quotient.
"""

import numpy as np

from calibration.numerics.compiled import njit
from calibration.stages.stick_slip.kernel.bases import (
    BITS,
    LANES,
    LEANS,
    LOAD,
    MASS,
    NOW,
    PULL,
    SLID,
    STUCK,
    WHEEL,
    YIELDS,
    D,
    E,
    F,
    U,
    W,
)

_NONE = 1e-30  # [N2]
_G = 9.80665  # [m/s2]


@njit(cache=True, error_model="numpy")
def on_wheels(wheels: np.ndarray, s: np.ndarray, rx: float, ry: float, h: float, n: int) -> None:
    """Add the forces of wheels in n lanes of a flat state, and bit i where wheel i sticks; deflections follow."""
    rows, rate = WHEEL * LANES, 1.0 / h
    for i in range(len(wheels) // rows):
        w, bit, slide = wheels[i * rows : (i + 1) * rows], float(1 << i), 0
        for l in range(n):
            px, py, c = w[l], w[LANES + l], w[4 * LANES + l]
            d3, d4, d5 = s[LOAD * LANES + l], s[(LOAD + 1) * LANES + l], s[(LOAD + 2) * LANES + l]
            load = w[6 * LANES + l] + w[7 * LANES + l] * d3 + w[8 * LANES + l] * d4 + w[9 * LANES + l] * d5
            N = max(load, 0.0)
            turn, spin = s[(D + 2) * LANES + l], s[(NOW + 2) * LANES + l]
            mass, ux, uy = w[MASS * LANES + l] * rate, w[U * LANES + l], w[(U + 1) * LANES + l]
            qx, qy, hangs = px - w[E * LANES + l], py - w[(E + 1) * LANES + l], N - _G * w[MASS * LANES + l]
            ex = w[E * LANES + l] + s[D * LANES + l] - turn * qy
            ey = w[(E + 1) * LANES + l] + s[(D + 1) * LANES + l] + turn * qx
            fx = w[2 * LANES + l] * ex + c * (s[NOW * LANES + l] - spin * qy) - hangs * ry + mass * ux
            fy = w[3 * LANES + l] * ey + c * (s[(NOW + 1) * LANES + l] + spin * qx) + hangs * rx + mass * uy
            w[E * LANES + l], w[(E + 1) * LANES + l] = ex, ey
            s[STUCK * LANES + l], s[(STUCK + 1) * LANES + l], s[(STUCK + 2) * LANES + l] = fx, fy, N
            s[LEANS * LANES + l] += N * ex
            s[(LEANS + 1) * LANES + l] += N * ey
            s[PULL * LANES + l] += min(load, 0.0)
            s[F * LANES + l] += fx
            s[(F + 1) * LANES + l] += fy
            s[(F + 2) * LANES + l] += (px - ex) * fy - (py - ey) * fx
            s[BITS * LANES + l] += bit
            limit = w[5 * LANES + l] * N
            slide += 1 if (fx * fx + fy * fy > limit * limit) | (ux != 0.0) | (uy != 0.0) else 0
        if slide > 0:
            _sliding(w, s, bit, h, n)


@njit(cache=True, error_model="numpy")
def _sliding(w: np.ndarray, s: np.ndarray, bit: float, h: float, n: int) -> None:
    """Let a wheel slide in those of n lanes in which it bears more than friction: as it was left, it sticks."""
    for l in range(n):
        px, py, N = w[l] - w[E * LANES + l], w[LANES + l] - w[(E + 1) * LANES + l], s[(STUCK + 2) * LANES + l]
        fx, fy = s[STUCK * LANES + l], s[(STUCK + 1) * LANES + l]
        cut = min(w[5 * LANES + l] * N / np.sqrt(fx * fx + fy * fy + _NONE), 1.0)
        fx, fy = fx * (1.0 - cut), fy * (1.0 - cut)
        x, y = fx * w[YIELDS * LANES + l], fy * w[(YIELDS + 1) * LANES + l]
        mass = w[MASS * LANES + l] / h
        gx, gy = mass * (x - w[U * LANES + l]), mass * (y - w[(U + 1) * LANES + l])
        w[U * LANES + l], w[(U + 1) * LANES + l] = x, y
        w[E * LANES + l] -= h * x
        w[(E + 1) * LANES + l] -= h * y
        s[LEANS * LANES + l] -= N * (h * x)
        s[(LEANS + 1) * LANES + l] -= N * (h * y)
        s[W * LANES + l] += gx
        s[(W + 1) * LANES + l] += gy
        s[(W + 2) * LANES + l] += px * gy - py * gx
        s[F * LANES + l] -= fx
        s[(F + 1) * LANES + l] -= fy
        s[(F + 2) * LANES + l] -= px * fy - py * fx
        s[SLID * LANES + l] += 1.0 if cut < 1.0 else 0.0
        s[BITS * LANES + l] -= bit if cut < 1.0 else 0.0


@njit(cache=True, error_model="numpy")
def deflect_at_rest(wheels: np.ndarray, u: np.ndarray, n: int) -> None:
    """Deflect flat wheels of n lanes so that none pushes the floor sideways under the drive u (11,) at rest."""
    for i in range(len(wheels) // (WHEEL * LANES)):
        w = wheels[i * WHEEL * LANES : (i + 1) * WHEEL * LANES]
        for l in range(n):
            load = w[6 * LANES + l] + w[7 * LANES + l] * u[3] + w[8 * LANES + l] * u[4] + w[9 * LANES + l] * u[5]
            hangs = max(load, 0.0) - _G * w[MASS * LANES + l]
            w[E * LANES + l] += hangs * u[7] / w[2 * LANES + l]
            w[(E + 1) * LANES + l] -= hangs * u[6] / w[3 * LANES + l]


@njit(cache=True, error_model="numpy")
def yielding(wheels: np.ndarray, h: float, n: int) -> None:
    """Speeds of flat wheels, n lanes, that slide by the force that friction does not bear: 1 / (K h + c + m / h)."""
    for i in range(len(wheels) // (WHEEL * LANES)):
        w = wheels[i * WHEEL * LANES : (i + 1) * WHEEL * LANES]
        for l in range(n):
            own = w[4 * LANES + l] + w[MASS * LANES + l] / h
            w[YIELDS * LANES + l] = 1.0 / (w[2 * LANES + l] * h + own)
            w[(YIELDS + 1) * LANES + l] = 1.0 / (w[3 * LANES + l] * h + own)


@njit(cache=True, error_model="numpy")
def moving_wheels(wheels: np.ndarray) -> np.ndarray:
    """M (6,) of the wheels, the first lane's of flat ones: those of others stand within millimetres of them."""
    M = np.zeros(6)
    for i in range(len(wheels) // (WHEEL * LANES)):
        w = wheels[i * WHEEL * LANES :]
        px, py, mass = w[0], w[LANES], w[MASS * LANES]
        M[0] += mass
        M[2] -= mass * py
        M[3] += mass
        M[4] += mass * px
        M[5] += mass * (px * px + py * py)
    return M
