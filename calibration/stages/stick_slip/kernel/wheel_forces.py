"""Forces of wheels side by side: as if all stuck, then those are let slide whose friction does not bear them.

    g = K e + C de/dt + (N - m G) (-ry, rx) + m r d2/dt2 (-ry, rx),   f' = g + m / h u,   f = f' min(mu N / |f'|, 1)
    u <- (f' - f) / (K h / 2 + C + m / h),    e <- e - h / 2 (u_before + u),    W <- W + A' m / h (u - u_before)

of one wheel, see `integration`: f' bears what a wheel that slid loses when it stops; K in the denominator is what the
spring gives way in the step, e the one after the wheel has slid on by h / 2 u_before. Few wheels slide at a time, and
only those need a root and a quotient. A braked wheel of radius r rolls as the base tilts: its hub goes by r (ry, -rx),
and it bears its load at p - e + r (ry, -rx).
"""

import numpy as np

from calibration.numerics.compiled import njit
from calibration.stages.stick_slip.kernel.bases import (
    BITS,
    FAR,
    HELD,
    LANES,
    LEANS,
    LESS,
    LOAD,
    MASS,
    NOW,
    PULL,
    RADIUS,
    SLID,
    STUCK,
    TILTS,
    USUAL,
    VERTICAL,
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
def on_wheels(w: np.ndarray, s: np.ndarray, u: np.ndarray, h: float, n: int) -> None:
    """Add the forces of flat wheels in n lanes of a flat state, and bit i where wheel i sticks; deflections follow."""
    # No slices of w: each would be counted as a reference, which takes long.
    rx, ry, ax, ay, half, rate = u[6], u[7], u[TILTS], u[TILTS + 1], 0.5 * h, 1.0 / h
    for i in range(len(w) // (WHEEL * LANES)):
        o, bit, slide = i * WHEEL * LANES, float(1 << i), 0
        for l in range(n):
            k = o + l
            px, py, ux, uy = w[k], w[k + LANES], w[k + U * LANES], w[k + (U + 1) * LANES]
            c, kz, turn, spin = (
                w[k + 4 * LANES], w[k + VERTICAL * LANES], s[(D + 2) * LANES + l], s[(NOW + 2) * LANES + l]
            )  # fmt: skip
            d3, d4, d5 = s[LOAD * LANES + l], s[(LOAD + 1) * LANES + l], s[(LOAD + 2) * LANES + l]
            less = kz * (ry * w[k + E * LANES] - rx * w[k + (E + 1) * LANES])
            load = w[k + 6 * LANES] + w[k + 7 * LANES] * d3 + w[k + 8 * LANES] * d4 + w[k + 9 * LANES] * d5 - less
            N = max(load, 0.0)
            r, m = w[k + RADIUS * LANES], w[k + MASS * LANES]
            qx, qy, hangs = px - w[k + E * LANES], py - w[k + (E + 1) * LANES], N - _G * m
            ex = w[k + E * LANES] + s[D * LANES + l] - turn * qy - half * ux
            ey = w[k + (E + 1) * LANES] + s[(D + 1) * LANES + l] + turn * qx - half * uy
            by_ry, by_rx = hangs * ry + m * r * ay, hangs * rx + m * r * ax
            fx = w[k + 2 * LANES] * ex + c * (s[NOW * LANES + l] - spin * qy) - by_ry + rate * m * ux
            fy = w[k + 3 * LANES] * ey + c * (s[(NOW + 1) * LANES + l] + spin * qx) + by_rx + rate * m * uy
            w[k + E * LANES], w[k + (E + 1) * LANES] = ex, ey
            s[STUCK * LANES + l], s[(STUCK + 1) * LANES + l], s[(STUCK + 2) * LANES + l] = fx, fy, N
            s[LESS * LANES + l] += less
            s[LEANS * LANES + l] += N * (ex - r * ry) + less * px
            s[(LEANS + 1) * LANES + l] += N * (ey + r * rx) + less * py
            s[PULL * LANES + l] += min(load, 0.0)
            s[F * LANES + l] += fx
            s[(F + 1) * LANES + l] += fy
            s[(F + 2) * LANES + l] += (px - ex) * fy - (py - ey) * fx
            s[BITS * LANES + l] += bit
            slide += 1 if (fx * fx + fy * fy > (w[k + 5 * LANES] * N) ** 2) | (ux != 0.0) | (uy != 0.0) else 0
        if slide > 0:
            _sliding(w, o, s, bit, h, n)


@njit(cache=True, error_model="numpy")
def _sliding(w: np.ndarray, o: int, s: np.ndarray, bit: float, h: float, n: int) -> None:
    """Let the wheel from element o of w on, stuck so far, slide in those of n lanes in which friction does not hold."""
    for l in range(n):
        k = o + l
        px, py, N = w[k] - w[k + E * LANES], w[k + LANES] - w[k + (E + 1) * LANES], s[(STUCK + 2) * LANES + l]
        fx, fy = s[STUCK * LANES + l], s[(STUCK + 1) * LANES + l]
        cut = min(w[k + 5 * LANES] * N / np.sqrt(fx * fx + fy * fy + _NONE), 1.0)
        fx, fy = fx * (1.0 - cut), fy * (1.0 - cut)
        x, y = fx * w[k + YIELDS * LANES], fy * w[k + (YIELDS + 1) * LANES]
        mass = w[k + MASS * LANES] / h
        gx, gy = mass * (x - w[k + U * LANES]), mass * (y - w[k + (U + 1) * LANES])
        w[k + U * LANES], w[k + (U + 1) * LANES] = x, y
        w[k + E * LANES] -= 0.5 * h * x
        w[k + (E + 1) * LANES] -= 0.5 * h * y
        s[LEANS * LANES + l] -= 0.5 * N * h * x
        s[(LEANS + 1) * LANES + l] -= 0.5 * N * h * y
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
    """Deflect flat wheels of n lanes so that they push the floor sideways by what they hold under the drive u (13,).

    That is `HELD` [m, along x] under the load that is usual, (My, -Mx) [N.m], and the less the farther u is from it.
    """
    for i in range(len(wheels) // (WHEEL * LANES)):
        w = wheels[i * WHEEL * LANES : (i + 1) * WHEEL * LANES]
        for l in range(n):
            load = w[6 * LANES + l] + w[7 * LANES + l] * u[3] + w[8 * LANES + l] * u[4] + w[9 * LANES + l] * u[5]
            hangs = max(load, 0.0) - _G * w[MASS * LANES + l]
            by_my, by_mx = u[4] - w[USUAL * LANES + l], u[5] - w[(USUAL + 1) * LANES + l]
            held = w[HELD * LANES + l] * FAR**2 / (FAR**2 + by_my * by_my + by_mx * by_mx)
            w[E * LANES + l] += hangs * u[7] / w[2 * LANES + l] + held
            w[(E + 1) * LANES + l] -= hangs * u[6] / w[3 * LANES + l]


@njit(cache=True, error_model="numpy")
def yielding(wheels: np.ndarray, h: float, n: int) -> None:
    """Speeds of sliding wheels, flat, n lanes, by the force that friction does not bear: 1 / (K h / 2 + c + m / h)."""
    for i in range(len(wheels) // (WHEEL * LANES)):
        w = wheels[i * WHEEL * LANES : (i + 1) * WHEEL * LANES]
        for l in range(n):
            own = w[4 * LANES + l] + w[MASS * LANES + l] / h
            w[YIELDS * LANES + l] = 1.0 / (0.5 * w[2 * LANES + l] * h + own)
            w[(YIELDS + 1) * LANES + l] = 1.0 / (0.5 * w[3 * LANES + l] * h + own)


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
