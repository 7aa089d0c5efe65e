"""Heave and tilt of a base while it slips: both in one integration, since each accelerates the other.

    (M_hh - S M_ph) d2h/dt2 + C_hh dh/dt + K_hh h = w_h - S (w_p - F) + c(L)            S = M_hp M_pp^-1
    w of `integration`:  w_p - M_ph d2h/dt2

h: z, rx, ry, p: x, y, yaw, M_pp of the robot without wheels. F is what it puts on its wheels, from the two steps before
on, c(L) that of wheels that lift off, see `suspension.lifting_response`. Heave by the trapezoidal rule.
"""

from typing import NamedTuple

import numpy as np

from calibration.numerics.compiled import njit
from calibration.stages.stick_slip.kernel.bases import COLUMNS, STEPS, VECTOR, F, W
from calibration.stages.stick_slip.kernel.integration import advance
from calibration.stages.stick_slip.kernel.wheel_forces import moving_wheels

_REPEATS, _SETTLED = 20, 1e-3  # [N, N.m]
_UPPER = ((0, 1, 2), (1, 3, 4), (2, 4, 5))  # of a symmetric matrix, in its six elements


class Springs(NamedTuple):
    """What carries the base, of z, rx, ry.

    Attributes:
        K: (3, 3) of the wheels.
        C: (3, 3) their dampers.
        tangent: (3, 3) K and the weight's, see `suspension.base_response.Forcing`.
        rest: (3,) Fz, Mx, My at rest [N, N.m].
        standing: (m, 10) see `WheelSet.standing`.
    """

    K: np.ndarray
    C: np.ndarray
    tangent: np.ndarray
    rest: np.ndarray
    standing: np.ndarray


@njit(cache=True, error_model="numpy")
def _by(A: np.ndarray, x: np.ndarray) -> np.ndarray:
    """A x of a matrix (3, 3): a call of linear algebra takes longer."""
    y = np.empty(3)
    for i in range(3):
        y[i] = A[i, 0] * x[0] + A[i, 1] * x[1] + A[i, 2] * x[2]
    return y


@njit(cache=True, error_model="numpy")
def _stepped(
    of: Springs, inverse: np.ndarray, f: np.ndarray, h: np.ndarray, c: np.ndarray, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """h, its rate and acceleration (3, 3), and c (3,), a step [s] on, under f (3,) less what springs do.

    `inverse` is of the inertia and half a step of what resists.
    """
    half = h[1] + 0.5 * step * h[2]
    ahead = h[0] + step * (h[1] + 0.25 * step * h[2])
    f, new = f - _by(of.C, half) - _by(of.tangent, ahead), np.empty((3, 3))
    for _ in range(_REPEATS):
        new[2] = _by(inverse, f + c)
        new[1], new[0] = half + 0.5 * step * new[2], ahead + 0.25 * step * step * new[2]
        L, before, c = of.rest + _by(of.K, new[0]) + _by(of.C, new[1]), c, np.zeros(3)
        for w in of.standing:
            N = w[6] - w[7] * L[0] + w[8] * L[2] - w[9] * L[1]
            if N < 0.0:
                c[0], c[1], c[2] = c[0] - N, c[1] - N * w[1], c[2] + N * w[0]
        if np.abs(c - before).max() < _SETTLED:
            break
    return new, c


@njit(cache=True, error_model="numpy")
def heaving(
    state: np.ndarray, wheels: np.ndarray, w: np.ndarray, M: np.ndarray, rows: np.ndarray, of: Springs, step: float
) -> np.ndarray:
    """z, rx, ry (STEPS n, 3) [m, rad] of a base, one lane of `Bases`, from rest.

    Args:
        state: (ROWS, LANES), changed.
        wheels: (m, WHEEL, LANES), changed.
        w: (STEPS n, 6) change since rest: Fx, Fy, Mz, Fz, Mx, My [N, N.m].
        M: (n, 6, 6) in the same order.
        rows: (n, 15) inertia as `advance` takes it.
        of: Springs.
        step: [s].
    """
    out, h, c, drive = np.zeros((len(w), 3)), np.zeros((3, 3)), np.zeros(3), np.zeros((1, COLUMNS))
    before, floor, S, inverse = np.zeros(3), np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3))
    hp, ph, hh, plane = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    carried, resisting = moving_wheels(wheels.reshape(-1)), 0.5 * step * of.C + 0.25 * step * step * of.tangent
    for k in range(len(w)):
        if k % STEPS == 0:
            m = M[k // STEPS]
            hp[:], hh[:] = m[3:, :3], m[3:, 3:]
            for i in range(3):
                for j in range(3):
                    plane[i, j] = rows[k // STEPS, _UPPER[i][j]] - carried[_UPPER[i][j]]
            S[:] = hp @ np.linalg.inv(plane)
            ph[:] = hp.T
            inverse[:] = np.linalg.inv(hh - S @ ph + resisting)
        for i in range(3):
            now = state[F + i, 0] + state[W + i, 0]
            floor[i], before[i] = 2.0 * now - before[i], now
        h, c = _stepped(of, inverse, w[k, 3:] - _by(S, w[k, :3] - floor), h, c, step)
        moved, load = _by(ph, h[2]), of.rest + w[k, 3:] - _by(hh, h[2])
        for i in range(3):
            drive[0, i] = w[k, i] - moved[i]
        drive[0, 3], drive[0, 4], drive[0, 5] = -load[0], load[2], -load[1]
        drive[0, 6], drive[0, 7] = h[0, 1], h[0, 2]
        advance(state, wheels, drive, rows[k // STEPS], step, VECTOR)
        out[k] = h[0]
    return out
