"""Integration of a rigid base that sticks and slips on its wheels, in the floor's plane.

    M(t) dv/dt + sum_i A_i' f_i + B v = w(t),     dx/dt = v,     x = (x, y, yaw),   A_i = [1 0 -y_i; 0 1 x_i]
    f_i = K_i e_i + C_i de_i/dt + N_i (-ry, rx),   |f_i| <= mu_i N_i             e_i = A_i x - s_i, s_i the slider
    N_i = n_i + G_i (-Fz, My, -Mx)                                               shares of the vertical load

f_i is wheel i's action on the floor [N, frame 0]. The bushings turn with the tilt (rx, ry), which brings a share of
N_i into the floor's plane. A wheel whose force would exceed mu_i N_i slides: the force is cut to that length, and e_i
is what its spring and damper then hold, implicit in time. The rest is explicit, velocity first (symplectic Euler).

With a force plate, F its reading of sum_i A_i' f_i, the position is corrected at the rate g,

    dx = g h P (F - sum_i A_i' f_i),    P = (K_t + l K_0)^-1 K_t (K_t + l K_0)^-1

K_t the stiffness of the wheels that stick, K_0 that of all: P is K_0^-1 where all stick and 0 where all slide, when the
force does not depend on the position and a correction would run away.
Reference: Simo, Hughes, Computational Inelasticity, 1998, ch. 1 (return mapping).
"""

import numpy as np
from numba import njit

PLATE = 8  # first of the plate's columns of `drive`
STATE = 19  # numbers of a state, see `advance`
STEPS = 2  # of the integration to a sample
COLUMNS = 11  # of `drive`: w (3), -Fz, My, -Mx, rx, ry, plate's force (3)


@njit(cache=True, error_model="numpy")
def _solved(a: np.ndarray, b0: float, b1: float, b2: float) -> tuple[float, float, float]:
    """Solution of a symmetric system, a = (a00, a01, a02, a11, a12, a22)."""
    c00, c01, c02 = a[3] * a[5] - a[4] * a[4], a[2] * a[4] - a[1] * a[5], a[1] * a[4] - a[2] * a[3]
    c11, c12, c22 = a[0] * a[5] - a[2] * a[2], a[1] * a[2] - a[0] * a[4], a[0] * a[3] - a[1] * a[1]
    i = 1.0 / (a[0] * c00 + a[1] * c01 + a[2] * c02)
    return (
        (c00 * b0 + c01 * b1 + c02 * b2) * i,
        (c01 * b0 + c11 * b1 + c12 * b2) * i,
        (c02 * b0 + c12 * b1 + c22 * b2) * i,
    )


@njit(cache=True, error_model="numpy")
def _stiffness(wheels: np.ndarray, i: int, out: np.ndarray) -> None:
    """Add a wheel's stiffness to (k00, k01, k02, k11, k12, k22)."""
    px, py, kx, ky = wheels[i, 0], wheels[i, 1], wheels[i, 2], wheels[i, 3]
    out[0] += kx
    out[2] -= kx * py
    out[3] += ky
    out[4] += ky * px
    out[5] += kx * py * py + ky * px * px


@njit(cache=True, error_model="numpy")
def wheel_force(
    wheels: np.ndarray, i: int, e: np.ndarray, d: np.ndarray, state: np.ndarray, u: np.ndarray, h: float
) -> tuple[float, float, bool]:
    """Force of wheel i after the base has moved by d (5,), which ends in its load's parts; e (m, 2) follows."""
    px, py, kx, ky, c = wheels[i, 0], wheels[i, 1], wheels[i, 2], wheels[i, 3], wheels[i, 4]
    N = max(wheels[i, 6] + wheels[i, 7] * d[3] + wheels[i, 8] * d[4] + wheels[i, 9] * d[5], 0.0)
    qx, qy = -N * u[7], N * u[6]
    ex, ey = e[i, 0] + d[0] - d[2] * py, e[i, 1] + d[1] + d[2] * px
    fx = kx * ex + c * (state[3] - state[5] * py) + qx
    fy = ky * ey + c * (state[4] + state[5] * px) + qy
    square, limit = fx * fx + fy * fy, wheels[i, 5] * N
    slides = square > limit * limit
    if slides:
        cut, b = limit / np.sqrt(square), c / h
        fx, fy = fx * cut, fy * cut
        ex, ey = (fx - qx + b * e[i, 0]) / (kx + b), (fy - qy + b * e[i, 1]) / (ky + b)
    e[i, 0], e[i, 1] = ex, ey
    return fx, fy, slides


@njit(cache=True, error_model="numpy")
def _corrector(wheels: np.ndarray, sticks: int, share: float, out: np.ndarray) -> None:
    """P's six elements, row by row, upper; bit i of `sticks` is set where wheel i sticks."""
    s, a = np.zeros(6), np.zeros(6)
    for i in range(len(wheels)):
        _stiffness(wheels, i, a)
        if sticks >> i & 1:
            _stiffness(wheels, i, s)
    for k in range(6):
        a[k] = s[k] + share * a[k]
    n = 0
    for i in range(3):
        y0, y1, y2 = _solved(a, 1.0 * (i == 0), 1.0 * (i == 1), 1.0 * (i == 2))
        z0, z1 = s[0] * y0 + s[1] * y1 + s[2] * y2, s[1] * y0 + s[3] * y1 + s[4] * y2
        z = _solved(a, z0, z1, s[2] * y0 + s[4] * y1 + s[5] * y2)
        for j in range(i, 3):
            out[n] = z[j]
            n += 1


@njit(cache=True, error_model="numpy")
def advance(
    state: np.ndarray,
    e: np.ndarray,
    drive: np.ndarray,
    inertia: np.ndarray,
    wheels: np.ndarray,
    body: np.ndarray,
    h: float,
) -> float:
    """One sample on: state and deflections are changed; the share of wheels that slid is returned.

    Args:
        state: (19,) x, v, the correction to come, the acceleration, which wheels stuck plus one, P.
        e: (m, 2) deflections [m].
        drive: (k, 11) at k steps of h [s]: w, (-Fz, My, -Mx), (rx, ry), plate's force.
        inertia: (15,) M's six elements (row by row, upper) and what an acceleration adds to (-Fz, My, -Mx), (3, 3).
        wheels: (m, 10) x, y, kx, ky, c, mu, n, G.
        body: (4,) dampers of the base [N.s/m, N.m.s/rad], g [1/s] (0: no plate) and l [-].
        h: [s].
    """
    d, P = np.empty(6), state[13:]
    slid, m, gain = 0, len(wheels), body[2] * h
    for s in range(len(drive)):
        u = drive[s]
        for k in range(3):
            d[k] = h * state[3 + k] + state[6 + k]
            j = 6 + 3 * k
            d[3 + k] = u[3 + k] + inertia[j] * state[9] + inertia[j + 1] * state[10] + inertia[j + 2] * state[11]
        F0, F1, F2 = body[0] * state[3], body[0] * state[4], body[1] * state[5]
        sticks = 0
        for i in range(m):
            fx, fy, slides = wheel_force(wheels, i, e, d, state, u, h)
            F0 += fx
            F1 += fy
            F2 += wheels[i, 0] * fy - wheels[i, 1] * fx
            slid += slides
            sticks |= (not slides) << i
        if gain > 0.0:
            if state[12] != sticks + 1.0:
                state[12] = sticks + 1.0
                _corrector(wheels, sticks, body[3], P)
            r0, r1, r2 = gain * (u[PLATE] - F0), gain * (u[PLATE + 1] - F1), gain * (u[PLATE + 2] - F2)
            state[6] = P[0] * r0 + P[1] * r1 + P[2] * r2
            state[7] = P[1] * r0 + P[3] * r1 + P[4] * r2
            state[8] = P[2] * r0 + P[4] * r1 + P[5] * r2
        state[9], state[10], state[11] = _solved(inertia, u[0] - F0, u[1] - F1, u[2] - F2)
        for k in range(3):
            state[k] += d[k]
            state[3 + k] += h * state[9 + k]
    return slid / (m * len(drive))


@njit(cache=True, error_model="numpy")
def simulated(
    starts: np.ndarray,
    drive: np.ndarray,
    inertia: np.ndarray,
    wheels: np.ndarray,
    body: np.ndarray,
    h: float,
    preload: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3) [m, rad] and shares of wheels that slid (n,) of trials one after the other.

    Args:
        starts: Sample at which each trial starts, and n; each starts at rest.
        drive: (n k, 11), k steps to a sample.
        inertia: (n, 15).
        wheels: (m, 10).
        body: (4,).
        h: Length of a step [s].
        preload: (m, 2) deflections at the start of each trial [m].
    """
    n, m = len(inertia), len(wheels)
    k = len(drive) // n
    x, share, e, state = np.empty((n, 3)), np.empty(n), np.empty((m, 2)), np.empty(STATE)
    for trial in range(len(starts) - 1):
        for i in range(m):
            e[i, 0], e[i, 1] = preload[i, 0], preload[i, 1]
        for i in range(STATE):
            state[i] = 0.0
        for t in range(starts[trial], starts[trial + 1]):
            share[t] = advance(state, e, drive[t * k : (t + 1) * k], inertia[t], wheels, body, h)
            for i in range(3):
                x[t, i] = state[i]
    return x, share


@njit(cache=True, error_model="numpy")
def advance_members(
    states: np.ndarray,
    e: np.ndarray,
    drive: np.ndarray,
    inertia: np.ndarray,
    wheels: np.ndarray,
    bodies: np.ndarray,
    h: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """`advance` for the members of an ensemble, k of them, then for preloaded ones of the first member's parameters.

    Args:
        states: (k + p, STATE), changed.
        e: (k + p, m, 2), changed.
        drive: (steps, 11).
        inertia: (15,).
        wheels: (k + p, m, 10).
        bodies: (k + p, 5): as `advance` takes it, and 1 for a member, 0 for a preloaded one.
        h: [s].

    Returns:
        Mean and variance (3,) of the members, mean square (3,) of the preloaded about the first, share that slid.
    """
    mean, variance, preloaded, share, members = np.zeros(3), np.zeros(3), np.zeros(3), 0.0, 0
    for i in range(len(states)):
        own = advance(states[i], e[i], drive, inertia, wheels[i], bodies[i], h)
        share = own if i == 0 else share
        members += bodies[i, 4] > 0.0
        for a in range(3):
            if bodies[i, 4] > 0.0:
                mean[a] += states[i, a]
            else:
                preloaded[a] += (states[i, a] - states[0, a]) ** 2
    others = max(len(states) - members, 1)
    for a in range(3):
        mean[a] /= members
        preloaded[a] /= others
        for i in range(members):
            variance[a] += (states[i, a] - mean[a]) ** 2 / members
    return mean, variance, preloaded, share


@njit(cache=True, error_model="numpy")
def banded(
    ensemble: tuple[np.ndarray, np.ndarray, np.ndarray],
    before: np.ndarray,
    share: float,
    band: np.ndarray,
    elastic: np.ndarray,
    out: np.ndarray,
) -> None:
    """Band and believed motion of one sample, see `band`: rows mean, path, largest square of a slip, x, variance, G.

    Args:
        ensemble: As of `advance_members`, (3,) each.
        before: (6, 3) as returned a sample ago.
        share: That slid.
        band: (4, 3) s, r, p, l.
        elastic: (3,) what springs alone do.
        out: (6, 3), filled.
    """
    moved, spread, preloaded = ensemble
    for a in range(3):
        path = before[1, a] + share * abs(moved[a] - before[0, a])
        slip = moved[a] - elastic[a]
        excess = band[1, a] ** 2 * spread[a] + band[2, a] ** 2 * preloaded[a] + (band[3, a] * path) ** 2
        largest = max(before[2, a], slip * slip)
        kept = 1.0 - min(excess / largest, 1.0) if largest > 0.0 else 0.0
        out[0, a], out[1, a], out[2, a] = moved[a], path, largest
        out[3, a], out[4, a] = elastic[a] + kept * slip, band[0, a] ** 2 + excess
        out[5, a] = max(before[5, a], elastic[a] * elastic[a])


@njit(cache=True, error_model="numpy")
def sample_row(wrench: np.ndarray, tilt: np.ndarray, driving: np.ndarray, rest: np.ndarray, row: np.ndarray) -> None:
    """A sample as `advance` takes it (11,), less what rests (6,): the plate's (Fx, Fy, Mz), inverse dynamics'."""
    for a in range(3):
        row[a] = driving[a] - rest[3 + a]
    row[3], row[4], row[5], row[6], row[7] = -wrench[2], wrench[4], -wrench[3], tilt[0], tilt[1]
    row[8], row[9], row[10] = wrench[0] - rest[0], wrench[1] - rest[1], wrench[5] - rest[2]


@njit(cache=True, error_model="numpy")
def step_members(
    states: np.ndarray,
    e: np.ndarray,
    readings: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    fitted: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    h: float,
    row: np.ndarray,
    found: np.ndarray,
) -> None:
    """`advance_members` from one sample to the next, and `banded`; in between, readings are linear.

    Args:
        states: Changed.
        e: Changed.
        readings: Wrench, tilt, driving (9,) and rest of `sample_row`; `row` and `found` of the sample before.
        fitted: Wheels, bodies, K_0^-1 (3, 3), band (4, 3).
        h: [s].
        row: (11,) of this sample, filled.
        found: (6, 3) of `banded`, filled.
    """
    (wrench, tilt, driving, rest, earlier, before), (wheels, bodies, compliance, band) = readings, fitted
    drive, inertia, elastic = np.empty((STEPS, COLUMNS)), np.zeros(15), np.zeros(3)
    sample_row(wrench, tilt, driving, rest, row)
    for s in range(STEPS):
        for c in range(COLUMNS):
            drive[s, c] = earlier[c] + (s + 1.0) / STEPS * (row[c] - earlier[c])
    for i in range(6):
        inertia[i] = driving[3 + i]
    for i in range(3):
        for c in range(3):
            elastic[i] += compliance[i, c] * row[PLATE + c]
    mean, spread, preloaded, share = advance_members(states, e, drive, inertia, wheels, bodies, h)
    banded((mean, spread, preloaded), before, share, band, elastic, found)
