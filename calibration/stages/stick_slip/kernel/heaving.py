"""Heave and tilt of a base while it slips: both in one integration, since each accelerates the other.

    (M_hh - S M_ph) d2h/dt2 + C_hh dh/dt + K_hh h = w_h - S (w_p - F) + c(L)            S = M_hp M_pp^-1
    w of `integration`:  w_p - M_ph d2h/dt2

h: z, rx, ry, p: x, y, yaw, M_pp of the robot without wheels. F is what it puts on its wheels, from the two steps before
on, c(L) that of wheels that lift off, see `suspension.lifting_response`. Heave by the trapezoidal rule.

Where a plate measures what the wheels bear, f, heave follows it, and its acceleration is that of heave up to BALANCED,

    d2h/dt2 = [d2h/dt2 - a] + a        M a = w - f        [.]: below BALANCED, about which the base resonates

since above it heave's second derivative multiplies the plate's noise by more than the base's inertia divides it.
"""

from typing import NamedTuple

import numpy as np

from calibration.numerics.compiled import njit
from calibration.numerics.signals import Signal, low_passed
from calibration.stages.stick_slip.kernel.bases import COLUMNS, HEAVE, STEPS, TILTS, F, W
from calibration.stages.stick_slip.kernel.integration import advance
from calibration.stages.stick_slip.kernel.wheel_forces import deflect_at_rest, moving_wheels

BALANCED = 6.0  # [Hz]
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
        leans: (2,) rx, ry from the vertical at rest [rad].
    """

    K: np.ndarray
    C: np.ndarray
    tangent: np.ndarray
    rest: np.ndarray
    standing: np.ndarray
    leans: np.ndarray


def damped(K: np.ndarray, C: np.ndarray) -> np.ndarray:
    """Dampers (3, 3) that damp heave at least as long as tilt, C / K of the same wheels.

    The robot's motions hardly show those of heave: where they are found to be next to none it rings up as wheels lift.
    """
    lag = np.diag(C)[1:] / np.diag(K)[1:]
    found = C.copy()
    found[0, 0] = max(C[0, 0], K[0, 0] * float(lag.min()))
    return found


def accelerations(t: np.ndarray, sprung: np.ndarray, left: np.ndarray, M: np.ndarray) -> np.ndarray:
    """Of z, rx, ry (n, 3) [m/s2, rad/s2] at even times t (n,) [s] of a base on a force plate.

    Args:
        t: Times.
        sprung: (n, 3) those of heave and tilt by the plate's wrench.
        left: (n, 6) w - f: of inverse dynamics on a base at rest less the plate's [N, N.m].
        M: (n, 6, 6) inertia of the robot.
    """
    a = np.linalg.solve(M, left[:, :, None])[:, HEAVE, 0]
    return a + low_passed(Signal(t, sprung - a, np.ones(len(t), dtype=bool)), BALANCED).x


@njit(cache=True, error_model="numpy")
def _by(A: np.ndarray, x: np.ndarray) -> np.ndarray:
    """A x of a matrix (3, 3): a call of linear algebra takes longer."""
    y = np.empty(3)
    for i in range(3):
        y[i] = A[i, 0] * x[0] + A[i, 1] * x[1] + A[i, 2] * x[2]
    return y


@njit(cache=True, error_model="numpy")
def _inverse(A: np.ndarray) -> np.ndarray:
    """Of a matrix (3, 3)."""
    B = np.empty((3, 3))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for n in range(3):
            p, q = (n + 1) % 3, (n + 2) % 3
            B[n, i] = A[j, p] * A[k, q] - A[j, q] * A[k, p]
    d = A[0, 0] * B[0, 0] + A[0, 1] * B[1, 0] + A[0, 2] * B[2, 0]
    for i in range(3):
        for n in range(3):
            B[i, n] /= d
    return B


@njit(cache=True, error_model="numpy")
def _stepped(
    of: Springs, inverse: np.ndarray, f: np.ndarray, h: np.ndarray, c: np.ndarray, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """h, its rate and acceleration (3, 3), and c (3,), a step [s] on, under f (3,) less what springs do.

    `inverse` is of the inertia and half a step of what resists.
    """
    half, ahead, force, new = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    for i in range(3):
        half[i] = h[1, i] + 0.5 * step * h[2, i]
        ahead[i] = h[0, i] + step * (h[1, i] + 0.25 * step * h[2, i])
    damped, sprung = _by(of.C, half), _by(of.tangent, ahead)
    for _ in range(_REPEATS):
        for i in range(3):
            force[i] = f[i] - damped[i] - sprung[i] + c[i]
        a = _by(inverse, force)
        for i in range(3):
            new[2, i] = a[i]
            new[1, i], new[0, i] = half[i] + 0.5 * step * a[i], ahead[i] + 0.25 * step * step * a[i]
        before, c = c, _pulls(of, _by(of.K, new[0]), _by(of.C, new[1]))
        if max(abs(c[0] - before[0]), abs(c[1] - before[1]), abs(c[2] - before[2])) < _SETTLED:
            break
    return new, c


@njit(cache=True, error_model="numpy")
def _pulls(of: Springs, sprung: np.ndarray, damped: np.ndarray) -> np.ndarray:
    """c (3,) of wheels off the floor, by what springs and dampers bear (3,)."""
    c = np.zeros(3)
    z, rx, ry = (
        of.rest[0] + sprung[0] + damped[0],
        of.rest[1] + sprung[1] + damped[1],
        of.rest[2] + sprung[2] + damped[2],
    )
    for k in range(len(of.standing)):
        w = of.standing[k]
        N = w[6] - w[7] * z + w[8] * ry - w[9] * rx
        if N < 0.0:
            c[0], c[1], c[2] = c[0] - N, c[1] - N * w[1], c[2] + N * w[0]
    return c


@njit(cache=True, error_model="numpy")
def _sampled(
    M: np.ndarray,
    row: np.ndarray,
    carried: np.ndarray,
    of: Springs,
    step: float,
    out: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> np.ndarray:
    """The inverse that `_stepped` takes; S, M_ph and M_hh (3, 3) of a sample are filled."""
    (S, ph, hh), A = out, np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            ph[i, j], hh[i, j], A[i, j] = M[3 + j, i], M[3 + i, 3 + j], row[_UPPER[i][j]] - carried[_UPPER[i][j]]
    plane = _inverse(A)
    for i in range(3):
        for j in range(3):
            S[i, j] = ph[0, i] * plane[0, j] + ph[1, i] * plane[1, j] + ph[2, i] * plane[2, j]
    for i in range(3):
        for j in range(3):
            moved = S[i, 0] * ph[0, j] + S[i, 1] * ph[1, j] + S[i, 2] * ph[2, j]
            A[i, j] = hh[i, j] - moved + 0.5 * step * of.C[i, j] + 0.25 * step * step * of.tangent[i, j]
    return _inverse(A)


@njit(cache=True, error_model="numpy")
def heaving(  # noqa: PLR0913
    state: np.ndarray,
    wheels: np.ndarray,
    lanes: int,
    w: np.ndarray,
    M: np.ndarray,
    rows: np.ndarray,
    of: Springs,
    step: float,
) -> np.ndarray:
    """z, rx, ry (STEPS n, 3) [m, rad] of a base, one lane of `Bases`, from rest.

    Args:
        state: (ROWS, LANES), changed.
        wheels: (m, WHEEL, LANES), changed.
        lanes: As `advance` takes them.
        w: (STEPS n, 6) change since rest: Fx, Fy, Mz, Fz, Mx, My [N, N.m].
        M: (n, 6, 6) in the same order.
        rows: (n, 15) inertia as `advance` takes it.
        of: Springs.
        step: [s].
    """
    out, h, c, drive = np.zeros((len(w), 3)), np.zeros((3, 3)), np.zeros(3), np.zeros((1, COLUMNS))
    before, floor, left, carried = np.zeros(3), np.zeros(3), np.zeros(3), moving_wheels(wheels.reshape(-1))
    drive[0, 3], drive[0, 4], drive[0, 5] = -of.rest[0], of.rest[2], -of.rest[1]
    drive[0, 6], drive[0, 7] = of.leans[0], of.leans[1]
    deflect_at_rest(wheels.reshape(-1), drive[0], lanes)
    S, ph, hh, inverse = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for k in range(len(w)):
        if k % STEPS == 0:
            inverse = _sampled(M[k // STEPS], rows[k // STEPS], carried, of, step, (S, ph, hh))
        for i in range(3):
            now = state[F + i, 0] + state[W + i, 0]
            floor[i], before[i] = 2.0 * now - before[i], now
            left[i] = w[k, i] - floor[i]
        driven = _by(S, left)
        for i in range(3):
            left[i] = w[k, 3 + i] - driven[i]
        h, c = _stepped(of, inverse, left, h, c, step)
        shared, own = _by(ph, h[2]), _by(hh, h[2])
        for i in range(3):
            drive[0, i], left[i] = w[k, i] - shared[i], of.rest[i] + w[k, 3 + i] - own[i]
            out[k, i] = h[0, i]
        drive[0, 3], drive[0, 4], drive[0, 5] = -left[0], left[2], -left[1]
        drive[0, 6], drive[0, 7] = of.leans[0] + h[0, 1], of.leans[1] + h[0, 2]
        drive[0, TILTS], drive[0, TILTS + 1] = h[2, 1], h[2, 2]
        advance(state, wheels, drive, rows[k // STEPS], step, lanes)
    return out
