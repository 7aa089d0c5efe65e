"""Response of a base with inertia to a wrench, whose wheels' springs do not pull.

    M d2x/dt2 + C dx/dt + K x = w + c(L)        L = w_rest + K x + C dx/dt,   c = sum_(N_i < 0) N_i a_i

N_i = n_i + G_i p are the wheels' loads where none lifts off, by p = (-Fz, My, -Mx) of L; a_i = (1, x_i, y_i), in the
same components. A step has the c found at its end, by repetition.
"""

import numpy as np

from calibration.numerics.compiled import njit
from calibration.numerics.signals import RATE
from calibration.stages.suspension.base_response import Forcing
from calibration.stages.suspension.modal_response import advance_modes, modes_of, predicted

_REPEATS, _SETTLED = 20, 1e-3  # [N, N.m]


def predicted_lifting(K: np.ndarray, C: np.ndarray, forcing: Forcing, standing: np.ndarray) -> np.ndarray:
    """`modal_response.predicted` (n, 6) [m, rad], by rows (m, 10) of `WheelSet.standing` of wheels that may lift off.

    `forcing` is that of a load with inertia: of inverse dynamics, not of a plate.
    """
    x = predicted(K, C, forcing)
    rates = np.gradient(x, 1.0 / RATE, axis=0)
    L = forcing.rest + x @ K.T + rates @ C.T
    N = standing[:, 6] + (L[:, (2, 4, 3)] * (-1.0, 1.0, -1.0)) @ standing[:, 7:10].T
    if not (N < 0.0).any():
        return x
    modes = modes_of(K + forcing.tangent, C, forcing.inertia)
    rows = np.ascontiguousarray(standing)
    _respond((modes.a, modes.b, modes.tau), (K, C, forcing.rest), rows, np.ascontiguousarray(forcing.w), 1.0 / RATE, x)
    return x


@njit(cache=True, error_model="numpy")
def _respond(
    modes: tuple[np.ndarray, np.ndarray, np.ndarray],
    springs: tuple[np.ndarray, np.ndarray, np.ndarray],
    standing: np.ndarray,
    w: np.ndarray,
    step: float,
    x: np.ndarray,
) -> None:
    """Displacements x (n, 6) are filled; in balance with the first wrench (n, 6) before, none lifts off then."""
    b, c, drive = modes[1], np.zeros(3), np.empty(6)
    u = np.zeros(len(b), dtype=np.complex128)
    for m in range(len(b)):
        for i in range(6):
            u[m] += b[m, i] * w[0, i]
    y = u.copy()
    for n in range(len(w)):
        for i in range(6):
            drive[i] = w[n, i]
        for _ in range(_REPEATS):
            drive[2], drive[3], drive[4] = w[n, 2] - c[0], w[n, 3] - c[2], w[n, 4] + c[1]
            found = advance_modes(modes, y, u, drive, step, x[n])
            before, c = c, _pulls(modes, springs, standing, found, x[n])
            if max(abs(c[0] - before[0]), abs(c[1] - before[1]), abs(c[2] - before[2])) < _SETTLED:
                break
        y, u = found[0], found[1]


@njit(cache=True, error_model="numpy")
def _pulls(
    modes: tuple[np.ndarray, np.ndarray, np.ndarray],
    springs: tuple[np.ndarray, np.ndarray, np.ndarray],
    standing: np.ndarray,
    found: np.ndarray,
    x: np.ndarray,
) -> np.ndarray:
    """c (3,) of modes y, u (2, k) and their displacement x (6,)."""
    (a, _, tau), (K, C, rest), rate, c, L = modes, springs, np.zeros(6), np.zeros(3), np.empty(6)
    for m in range(len(tau)):
        moving = (found[1, m] - found[0, m]) / tau[m]
        for i in range(6):
            rate[i] += (a[i, m] * moving).real
    for i in range(2, 5):
        L[i] = rest[i]
        for j in range(6):
            L[i] += K[i, j] * x[j] + C[i, j] * rate[j]
    for k in range(len(standing)):
        w = standing[k]
        N = w[6] - w[7] * L[2] + w[8] * L[4] - w[9] * L[3]
        if N < 0.0:
            c[0], c[1], c[2] = c[0] + N, c[1] + N * w[0], c[2] + N * w[1]
    return c
