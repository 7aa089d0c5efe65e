"""Load of a base of which wheels are off the floor, as if these could pull: then the others bear what they do bear.

    N_i = n_i + G_i (p + c),   a_i = (1, x_i, y_i),   c = sum_(N_i < 0) N_i a_i        sum_(N_i > 0) N_i a_i = p

p is (-Fz, My, -Mx). With J the wheels off the floor, A c = b of A = 1 - sum_J a_i G_i and b = sum_J a_i (n_i + G_i p);
J is found by trying. Where fewer than three wheels are left, the base tips over, and p stays as it is.

A force plate stands still: about a base that has slid by (x, y, yaw) its moments are R(yaw)' ((My, -Mx) + Fz (x, y)).
"""

from dataclasses import replace

import numpy as np

from calibration.numerics.compiled import njit
from calibration.numerics.signals import Signal, interpolate_columns
from calibration.stages.stick_slip.kernel.bases import LANES, LOAD, WHEEL, E
from calibration.stages.suspension.floor_wrench import Load

_LEGS = 3


@njit(cache=True, error_model="numpy")
def _cross(a: np.ndarray, b: np.ndarray) -> tuple[float, float, float]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True, error_model="numpy")
def _solution(A: np.ndarray, b: np.ndarray, out: np.ndarray) -> None:
    """Of A x = b by Cramer's rule, A (3, 3) by its columns."""
    for k in range(3):
        x, y, z = _cross(A[(k + 1) % 3], A[(k + 2) % 3])
        out[k] = (b[0] * x + b[1] * y + b[2] * z) / (A[k, 0] * x + A[k, 1] * y + A[k, 2] * z)


@njit(cache=True, error_model="numpy")
def _taken_off(w: np.ndarray, own: float, A: np.ndarray, b: np.ndarray) -> None:
    """Add a_i G_i of a wheel off the floor to A, and a_i times its own load to b."""
    for j in range(3):
        a = w[j - 1] if j > 0 else 1.0
        b[j] += a * own
        for k in range(3):
            A[k, j] -= w[7 + k] * a


@njit(cache=True, error_model="numpy")
def pulled(rows: np.ndarray, p: np.ndarray) -> np.ndarray:
    """c (3,) of a load p (3,), by rows (m, 10 or more) of wheels as `at_rest` takes them."""
    m, legs = len(rows), 0
    off, A, b, c = np.zeros(m, np.bool_), np.empty((3, 3)), np.empty(3), np.zeros(3)
    for _ in range(m):
        same, legs = True, m
        for i in range(3):
            b[i] = 0.0
            for j in range(3):
                A[i, j] = 1.0 if i == j else 0.0
        for i in range(m):
            w = rows[i]
            own = w[6] + w[7] * p[0] + w[8] * p[1] + w[9] * p[2]
            pulls = own + w[7] * c[0] + w[8] * c[1] + w[9] * c[2] < 0.0
            same, off[i] = same and off[i] == pulls, pulls
            if pulls:
                legs -= 1
                _taken_off(w, own, A, b)
        if same or legs < _LEGS:
            break
        _solution(A, b, c)
    return c if legs >= _LEGS else np.zeros(3)


@njit(cache=True, error_model="numpy")
def lifted(wheels: np.ndarray, s: np.ndarray, lane: int) -> None:
    """Add c to the load of a lane of a flat state, by its flat wheels."""
    at, rows, p = LOAD * LANES + lane, np.empty((len(wheels) // (WHEEL * LANES), E)), np.empty(3)
    for i in range(len(rows)):
        for k in range(E):
            rows[i, k] = wheels[(i * WHEEL + k) * LANES + lane]
    for k in range(3):
        p[k] = s[at + k * LANES]
    c = pulled(rows, p)
    for k in range(3):
        s[at + k * LANES] += c[k]


def on_wheels(load: Load, standing: np.ndarray, slid: Signal | None) -> Load:
    """A plate's load as the wheels bear it, rows (m, 10), of a base that has slid."""
    t, x = load.signal.t, load.signal.x
    moved = None if slid is None else interpolate_columns(t, slid.t, slid.x)
    return replace(load, signal=replace(load.signal, x=borne(standing, x, moved)))


def borne(standing: np.ndarray, wrench: np.ndarray, slid: np.ndarray | None = None) -> np.ndarray:
    """Wrenches (n, 6) on the floor [N, N.m, frame 0] as if wheels, rows (m, 10), could pull.

    The springs being linear, heave and tilt are those of the wheels in contact. `slid` (n, 3): how far the base has.
    """
    found = np.array(wrench, dtype=float, order="C")
    bear(standing, found, np.zeros((len(found), 3)) if slid is None else slid)
    return found


@njit(cache=True, error_model="numpy")
def bear(standing: np.ndarray, wrench: np.ndarray, slid: np.ndarray) -> None:
    """Turn (-Fz, My, -Mx) of wrenches (n, 6) to a base that has slid (n, 3), add c, by rows (m, 10) of wheels."""
    p = np.empty(3)
    for k in range(len(wrench)):
        w, yaw = wrench[k], slid[k, 2]
        pitching, rolling = w[4] + w[2] * slid[k, 0], -w[3] + w[2] * slid[k, 1]
        p[0], p[1], p[2] = -w[2], pitching + yaw * rolling, rolling - yaw * pitching
        c = pulled(standing, p)
        w[2], w[3], w[4] = -p[0] - c[0], -p[2] - c[2], p[1] + c[1]
