"""Integration of a rigid base that sticks and slips on its wheels, in the floor's plane.

    M(t) dv/dt + sum_i A_i' f_i + B v = w(t),     dx/dt = v,     x = (x, y, yaw),   A_i = [1 0 -y_i; 0 1 x_i]
    f_i = K_i e_i + C_i de_i/dt + N_i (-ry, rx),   |f_i| <= mu_i N_i             e_i = A_i x - s_i, s_i the slider
    N_i = n_i + G_i (-Fz, My, -Mx)                                               shares of the load about the base

f_i is wheel i's action on the floor [N, frame 0]. The bushings turn with the tilt (rx, ry), which brings a share of
N_i into the floor's plane. A wheel whose force would exceed mu_i N_i slides: the force is cut to that length, and e_i
is what its spring and damper then hold, implicit in time. The rest is explicit, velocity first (symplectic Euler).

A force plate stands still: (My, -Mx) about the base is R(yaw)' ((My, -Mx)_0 + Fz (x, y)). Seven millimetres move 10 N
from one drive to the other.

With a force plate, F its reading of sum_i A_i' f_i, the position is corrected at the rate g,

    dx = g h P (F - sum_i A_i' f_i),    P = (K_t + l K_0)^-1 K_t (K_t + l K_0)^-1

K_t the stiffness of the wheels that stick, K_0 that of all: P is K_0^-1 where all stick and 0 where all slide, when the
force does not depend on the position and a correction would run away.

Some bases that differ in their parameters or preloads are integrated under the same load side by side, LANES numbers
to a row, so that each row is computed by vector instructions.
Reference: Simo, Hughes, Computational Inelasticity, 1998, ch. 1 (return mapping).
"""

from typing import NamedTuple

import numpy as np

from calibration.numerics.compiled import njit
from calibration.numerics.side_by_side import side_by_side

PLATE = 8  # first of the plate's columns of `drive`
STEPS = 2  # of the integration to a sample
COLUMNS = 11  # of `drive`: w (3), -Fz, My, -Mx, rx, ry, plate's force (3)
LANES = 16  # bases side by side
_VECTOR = 4  # lanes that one instruction takes
_WHEEL, _E = 12, 10  # rows of a wheel: x, y, kx, ky, c, mu, n, G (3), and its deflections from row _E on
VELOCITY, ACCELERATION = 3, 9  # three rows each of a state
_X, _V, _DX, _STICKS, _P = 0, VELOCITY, 6, 12, 13  # x, v, correction to come, wheels that stuck plus one, P
_D, _F, SLID, _BITS = 19, 25, 28, 29  # of the step: d, force, wheels that slide, which stick
_BODY, _ROWS = 30, 34  # dampers of the base [N.s/m, N.m.s/rad], g [1/s] (0: no plate) and l [-]


class Bases(NamedTuple):
    """k bases of m wheels, LANES to a group; the last ones of the last group repeat the last base.

    Attributes:
        state: (groups, _ROWS, LANES), see above.
        wheels: (groups, m, _WHEEL, LANES).
        lanes: (groups,) that count, a multiple of _VECTOR.
    """

    state: np.ndarray
    wheels: np.ndarray
    lanes: np.ndarray

    def deflection(self, i: int) -> np.ndarray:
        """Of the wheels (m, 2) of a base [m]."""
        return self.wheels[i // LANES, :, _E:, i % LANES]


def at_rest(wheels: np.ndarray, bodies: np.ndarray, preload: np.ndarray | None = None) -> Bases:
    """Bases at rest.

    Args:
        wheels: (k, m, 10) x, y, kx, ky, c, mu, n, G.
        bodies: (k, 4), see _BODY.
        preload: (k, m, 2) deflections [m]; None: none.
    """
    k, m = wheels.shape[:2]
    groups = -(-k // LANES)
    own = np.minimum(np.arange(groups * LANES), k - 1)
    e = np.zeros((k, m, 2)) if preload is None else preload
    rows = np.concatenate([wheels, e], axis=2)[own].reshape(groups, LANES, m, _WHEEL).transpose(0, 2, 3, 1)
    lanes = np.minimum(k - LANES * np.arange(groups), LANES)
    state = np.zeros((groups, _ROWS, LANES))
    state[:, _BODY:] = bodies[own].reshape(groups, LANES, 4).transpose(0, 2, 1)
    return Bases(state, np.ascontiguousarray(rows), -(-lanes // _VECTOR) * _VECTOR)


@njit(cache=True, error_model="numpy")
def _cofactors(a: np.ndarray) -> tuple[float, float, float, float, float, float, float]:
    """Of a symmetric matrix (a00, a01, a02, a11, a12, a22), and 1 / determinant."""
    c00, c01, c02 = a[3] * a[5] - a[4] * a[4], a[2] * a[4] - a[1] * a[5], a[1] * a[4] - a[2] * a[3]
    c11, c12, c22 = a[0] * a[5] - a[2] * a[2], a[1] * a[2] - a[0] * a[4], a[0] * a[3] - a[1] * a[1]
    return c00, c01, c02, c11, c12, c22, 1.0 / (a[0] * c00 + a[1] * c01 + a[2] * c02)


@njit(cache=True, error_model="numpy")
def solved(a: np.ndarray, b0: float, b1: float, b2: float) -> tuple[float, float, float]:
    """Solution of a symmetric system, a = (a00, a01, a02, a11, a12, a22)."""
    c00, c01, c02, c11, c12, c22, i = _cofactors(a)
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
def _corrector(wheels: np.ndarray, lane: int, share: float, state: np.ndarray) -> None:
    """P's six elements, row by row, upper, into a lane of a flat state."""
    s, a, sticks = np.zeros(6), np.zeros(6), int(state[_STICKS * LANES + lane]) - 1
    for i in range(len(wheels) // (_WHEEL * LANES)):
        o = i * _WHEEL * LANES + lane
        _stiffness(wheels, o, a)
        if sticks >> i & 1:
            _stiffness(wheels, o, s)
    for k in range(6):
        a[k] = s[k] + share * a[k]
    n = _P
    for i in range(3):
        y0, y1, y2 = solved(a, 1.0 * (i == 0), 1.0 * (i == 1), 1.0 * (i == 2))
        z0, z1 = s[0] * y0 + s[1] * y1 + s[2] * y2, s[1] * y0 + s[3] * y1 + s[4] * y2
        z = solved(a, z0, z1, s[2] * y0 + s[4] * y1 + s[5] * y2)
        for j in range(i, 3):
            state[n * LANES + lane] = z[j]
            n += 1


@njit(cache=True, error_model="numpy")
def _begun(s: np.ndarray, u: np.ndarray, inertia: np.ndarray, h: float, n: int) -> None:
    """d of a step in n lanes of a flat state, its last parts those of the load, and the base's dampers' force."""
    z, my, mx = u[3], u[4], u[5]
    z0, z1, z2, my0, my1, my2, mx0, mx1, mx2 = (
        inertia[6], inertia[7], inertia[8], inertia[9], inertia[10], inertia[11], inertia[12], inertia[13], inertia[14]
    )  # fmt: skip
    for l in range(n):
        a0, a1, a2 = s[ACCELERATION * LANES + l], s[(ACCELERATION + 1) * LANES + l], s[(ACCELERATION + 2) * LANES + l]
        s[_D * LANES + l] = h * s[_V * LANES + l] + s[_DX * LANES + l]
        s[(_D + 1) * LANES + l] = h * s[(_V + 1) * LANES + l] + s[(_DX + 1) * LANES + l]
        s[(_D + 2) * LANES + l] = h * s[(_V + 2) * LANES + l] + s[(_DX + 2) * LANES + l]
        moved = 1.0 if s[(_BODY + 2) * LANES + l] > 0.0 else 0.0
        pitching = my + my0 * a0 + my1 * a1 + my2 * a2 - moved * z * s[_X * LANES + l]
        rolling = mx + mx0 * a0 + mx1 * a1 + mx2 * a2 - moved * z * s[(_X + 1) * LANES + l]
        yaw = moved * s[(_X + 2) * LANES + l]
        s[(_D + 3) * LANES + l] = z + z0 * a0 + z1 * a1 + z2 * a2
        s[(_D + 4) * LANES + l] = pitching + yaw * rolling
        s[(_D + 5) * LANES + l] = rolling - yaw * pitching
        s[_F * LANES + l] = s[_BODY * LANES + l] * s[_V * LANES + l]
        s[(_F + 1) * LANES + l] = s[_BODY * LANES + l] * s[(_V + 1) * LANES + l]
        s[(_F + 2) * LANES + l] = s[(_BODY + 1) * LANES + l] * s[(_V + 2) * LANES + l]
        s[_BITS * LANES + l] = 1.0


@njit(cache=True, error_model="numpy")
def _on_wheels(wheels: np.ndarray, s: np.ndarray, rx: float, ry: float, h: float, n: int) -> None:
    """Add the forces of wheels in n lanes of a flat state, and bit i where wheel i sticks; deflections follow."""
    rows = _WHEEL * LANES
    for i in range(len(wheels) // rows):
        w, bit = wheels[i * rows : (i + 1) * rows], float(1 << i)
        for l in range(n):
            px, py, kx, ky = w[l], w[LANES + l], w[2 * LANES + l], w[3 * LANES + l]
            c, before_x, before_y = w[4 * LANES + l], w[_E * LANES + l], w[(_E + 1) * LANES + l]
            d3, d4, d5 = s[(_D + 3) * LANES + l], s[(_D + 4) * LANES + l], s[(_D + 5) * LANES + l]
            N = max(w[6 * LANES + l] + w[7 * LANES + l] * d3 + w[8 * LANES + l] * d4 + w[9 * LANES + l] * d5, 0.0)
            qx, qy, turn, spin = -N * ry, N * rx, s[(_D + 2) * LANES + l], s[(_V + 2) * LANES + l]
            ex, ey = before_x + s[_D * LANES + l] - turn * py, before_y + s[(_D + 1) * LANES + l] + turn * px
            fx = kx * ex + c * (s[_V * LANES + l] - spin * py) + qx
            fy = ky * ey + c * (s[(_V + 1) * LANES + l] + spin * px) + qy
            square, limit = fx * fx + fy * fy, w[5 * LANES + l] * N
            cut, b = limit / np.sqrt(square), c / h
            slides, x, y = square > limit * limit, fx * cut, fy * cut
            fx, fy = (x if slides else fx), (y if slides else fy)
            x, y = (x - qx + b * before_x) / (kx + b), (y - qy + b * before_y) / (ky + b)
            w[_E * LANES + l], w[(_E + 1) * LANES + l] = (x if slides else ex), (y if slides else ey)
            s[_F * LANES + l] += fx
            s[(_F + 1) * LANES + l] += fy
            s[(_F + 2) * LANES + l] += px * fy - py * fx
            s[SLID * LANES + l] += 1.0 if slides else 0.0
            s[_BITS * LANES + l] += 0.0 if slides else bit


@njit(cache=True, error_model="numpy")
def _corrected(s: np.ndarray, fx: float, fy: float, mz: float, h: float, n: int) -> None:
    """The correction of the next step, by P and the plate's force."""
    for l in range(n):
        gain = s[(_BODY + 2) * LANES + l] * h
        r0 = gain * (fx - s[_F * LANES + l])
        r1 = gain * (fy - s[(_F + 1) * LANES + l])
        r2 = gain * (mz - s[(_F + 2) * LANES + l])
        p0, p1, p2 = s[_P * LANES + l], s[(_P + 1) * LANES + l], s[(_P + 2) * LANES + l]
        p3, p4, p5 = s[(_P + 3) * LANES + l], s[(_P + 4) * LANES + l], s[(_P + 5) * LANES + l]
        s[_DX * LANES + l] = p0 * r0 + p1 * r1 + p2 * r2
        s[(_DX + 1) * LANES + l] = p1 * r0 + p3 * r1 + p4 * r2
        s[(_DX + 2) * LANES + l] = p2 * r0 + p4 * r1 + p5 * r2


@njit(cache=True, error_model="numpy")
def _ended(s: np.ndarray, u: np.ndarray, inertia: np.ndarray, h: float, n: int) -> None:
    """Accelerations by what the force leaves of the drive, positions and velocities a step on."""
    c00, c01, c02, c11, c12, c22, i = _cofactors(inertia)
    wx, wy, wz = u[0], u[1], u[2]
    for l in range(n):
        b0, b1, b2 = wx - s[_F * LANES + l], wy - s[(_F + 1) * LANES + l], wz - s[(_F + 2) * LANES + l]
        a0 = (c00 * b0 + c01 * b1 + c02 * b2) * i
        a1 = (c01 * b0 + c11 * b1 + c12 * b2) * i
        a2 = (c02 * b0 + c12 * b1 + c22 * b2) * i
        s[ACCELERATION * LANES + l], s[(ACCELERATION + 1) * LANES + l], s[(ACCELERATION + 2) * LANES + l] = a0, a1, a2
        s[_X * LANES + l] += s[_D * LANES + l]
        s[(_X + 1) * LANES + l] += s[(_D + 1) * LANES + l]
        s[(_X + 2) * LANES + l] += s[(_D + 2) * LANES + l]
        s[_V * LANES + l] += h * a0
        s[(_V + 1) * LANES + l] += h * a1
        s[(_V + 2) * LANES + l] += h * a2


@njit(cache=True, error_model="numpy")
def _advance(s: np.ndarray, wheels: np.ndarray, drive: np.ndarray, inertia: np.ndarray, h: float, n: int) -> None:
    """`advance` with all arrays of the bases flat."""
    for l in range(LANES):
        s[SLID * LANES + l] = 0.0
    for k in range(len(drive)):
        u = drive[k]
        _begun(s, u, inertia, h, n)
        _on_wheels(wheels, s, u[6], u[7], h, n)
        if s[(_BODY + 2) * LANES] > 0.0:
            for l in range(n):
                if s[_STICKS * LANES + l] != s[_BITS * LANES + l]:
                    s[_STICKS * LANES + l] = s[_BITS * LANES + l]
                    _corrector(wheels, l, s[(_BODY + 3) * LANES + l], s)
            _corrected(s, u[PLATE], u[PLATE + 1], u[PLATE + 2], h, n)
        _ended(s, u, inertia, h, n)


@njit(cache=True, error_model="numpy")
def advance(state: np.ndarray, wheels: np.ndarray, drive: np.ndarray, inertia: np.ndarray, h: float, n: int) -> None:
    """One sample on, the first n lanes of a group: states and deflections are changed.

    Args:
        state: (_ROWS, LANES); wheels that slid are counted in row SLID.
        wheels: (m, _WHEEL, LANES).
        drive: (k, 11) at k steps of h [s]: w, (-Fz, My, -Mx), (rx, ry), plate's force.
        inertia: (15,) M's six elements (row by row, upper) and what an acceleration adds to (-Fz, My, -Mx), (3, 3).
        h: [s].
        n: A multiple of _VECTOR.
    """
    _advance(state.reshape(-1), wheels.reshape(-1), drive, inertia, h, n)


def simulated(
    starts: np.ndarray, drive: np.ndarray, inertia: np.ndarray, bases: Bases, h: float, k: int
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (k, n, 3) [m, rad] and shares of wheels that slid (k, n) of k bases in trials one after the other.

    Args:
        starts: Sample at which each trial starts, and n.
        drive: (n steps, 11).
        inertia: (n, 15).
        bases: At rest: so each trial starts.
        h: Length of a step [s].
        k: How many of them.
    """
    x, share = np.empty((k, len(inertia), 3)), np.empty((k, len(inertia)))
    side_by_side(lambda a, b: _simulated(x, share, a, b, drive, inertia, bases, h), starts[:-1], starts[1:])
    return x, share


@njit(cache=True, error_model="numpy")
def _simulated(  # noqa: PLR0913
    x: np.ndarray,
    share: np.ndarray,
    a: int,
    b: int,
    drive: np.ndarray,
    inertia: np.ndarray,
    bases: Bases,
    h: float,
) -> None:
    """Samples a to b, one trial, of `simulated`'s x and share."""
    k, m, steps = len(x), bases.wheels.shape[1], len(drive) // len(inertia)
    for g in range(len(bases.lanes)):
        lanes = bases.lanes[g]
        state, wheels = bases.state[g].copy().reshape(-1), bases.wheels[g].copy().reshape(-1)
        for t in range(a, b):
            _advance(state, wheels, drive[t * steps : (t + 1) * steps], inertia[t], h, lanes)
            for l in range(min(lanes, k - LANES * g)):
                share[LANES * g + l, t] = state[SLID * LANES + l] / (m * steps)
                for i in range(3):
                    x[LANES * g + l, t, i] = state[(_X + i) * LANES + l]
