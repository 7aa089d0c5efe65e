"""Integration of a rigid base that sticks and slips on its wheels, in the floor's plane.

    M(t) dv/dt + sum_i A_i' g_i + B v = w(t),     dx/dt = R(yaw) v,     x = (x, y, yaw)
    g_i = K_i e_i + C_i de_i/dt + (N_i - m_i G) (-ry, rx) + m_i r_i d2/dt2 (-ry, rx)
    m_i du_i/dt = g_i - f_i,   |f_i| <= mu_i N_i
    de_i/dt = A_i v - u_i,    A_i = [1 0 -(y_i - e_iy); 0 1 x_i - e_ix]       u_i how fast wheel i slides, 0: it sticks
    N_i = n_i + G_i (-Fz, My, -Mx)                                            shares of the load about the wheels

Velocities, forces and deflections are in the axes of the base, which turn with yaw, x is in frame 0. f_i is wheel i's
action on the floor and g_i the base's on the wheel [N]; M is of the robot without wheels. The bushings lean with the
base, by (rx, ry) from the vertical, which brings a share of what they carry into the floor's plane: N_i less the
weight m_i G of the wheel; braked, it rolls on its radius r_i, its hub by r_i (ry, -rx). At rest wheels push the floor
sideways by what they hold, see `deflect_at_rest`. A wheel whose force would exceed mu_i N_i slides: the force is cut
to that length, and u_i is what that leaves, implicit in time; how far it slides follows by the trapezoidal rule. The
rest is explicit, velocity first (symplectic Euler): a step's position is that of the time of its load, its velocity
half a step older. Dampers feel v + h/2 dv/dt, that of the time of the load: without it they take a hundredth of the
inertia away.

A wheel bears where it touches the floor, e_i behind its place under the base and rolled on, by the step before:

    (My, -Mx) <- (My, -Mx) + sum_i N_i (e_i - r_i (ry, -rx))

and does not pull, see `lifted`. On a base that leans its vertical spring, of stiffness k, is let out as its hub goes
where the base is higher, and all wheels bear what it bears less, p_i = k_i (ry e_ix - rx e_iy):

    N_i <- N_i - p_i,    (-Fz, My, -Mx) <- (-Fz, My, -Mx) + sum_i p_i (1, x_i, y_i)

4 N of a drive that is 8 mm behind, in a jolt. A force plate stands still: (My, -Mx) about the base is
R(yaw)' ((My, -Mx)_0 + Fz (x, y)). Seven millimetres move 10 N from one drive to the other.

With a force plate the position is corrected, see `corrector`, and bases may be judged by what it measures, F, beside
what their wheels bear, see `preloaded`. Some bases that differ in their parameters or preloads are integrated side by
side under the same load, see `Bases`.
Reference: Simo, Hughes, Computational Inelasticity, 1998, ch. 1 (return mapping).
"""

import numpy as np

from calibration.numerics.compiled import njit
from calibration.numerics.side_by_side import side_by_side
from calibration.stages.stick_slip.kernel.bases import (
    ACCELERATION,
    BITS,
    BODY,
    DX,
    LANES,
    LEANS,
    LESS,
    LOAD,
    MISSED,
    NOISE,
    NOW,
    PLATE,
    PULL,
    SLID,
    STICKS,
    UNLIKELY,
    Bases,
    D,
    F,
    P,
    V,
    W,
    X,
)
from calibration.stages.stick_slip.kernel.corrector import cofactors, corrector
from calibration.stages.stick_slip.kernel.lifted import lifted
from calibration.stages.stick_slip.kernel.wheel_forces import deflect_at_rest, moving_wheels, on_wheels, yielding


@njit(cache=True, error_model="numpy")
def _begun(s: np.ndarray, u: np.ndarray, inertia: np.ndarray, h: float, n: int) -> int:
    """d of a step in n lanes of a flat state, the load, and the base's dampers' force; lanes in which wheels pulled."""
    z, my, mx, pull = u[3], u[4], u[5], 0
    z0, z1, z2, my0, my1, my2, mx0, mx1, mx2 = (
        inertia[6], inertia[7], inertia[8], inertia[9], inertia[10], inertia[11], inertia[12], inertia[13], inertia[14]
    )  # fmt: skip
    for l in range(n):
        a0, a1, a2 = s[ACCELERATION * LANES + l], s[(ACCELERATION + 1) * LANES + l], s[(ACCELERATION + 2) * LANES + l]
        s[D * LANES + l] = h * s[V * LANES + l] + s[DX * LANES + l]
        s[(D + 1) * LANES + l] = h * s[(V + 1) * LANES + l] + s[(DX + 1) * LANES + l]
        s[(D + 2) * LANES + l] = h * s[(V + 2) * LANES + l] + s[(DX + 2) * LANES + l]
        moved = 1.0 if s[(BODY + 2) * LANES + l] > 0.0 else 0.0
        pitching = my + my0 * a0 + my1 * a1 + my2 * a2 - moved * z * s[X * LANES + l]
        rolling = mx + mx0 * a0 + mx1 * a1 + mx2 * a2 - moved * z * s[(X + 1) * LANES + l]
        yaw = moved * s[(X + 2) * LANES + l]
        s[LOAD * LANES + l] = z + z0 * a0 + z1 * a1 + z2 * a2 + s[LESS * LANES + l]
        s[(LOAD + 1) * LANES + l] = pitching + yaw * rolling + s[LEANS * LANES + l]
        s[(LOAD + 2) * LANES + l] = rolling - yaw * pitching + s[(LEANS + 1) * LANES + l]
        v0, v1 = s[V * LANES + l] + 0.5 * h * a0, s[(V + 1) * LANES + l] + 0.5 * h * a1
        v2 = s[(V + 2) * LANES + l] + 0.5 * h * a2
        s[NOW * LANES + l], s[(NOW + 1) * LANES + l], s[(NOW + 2) * LANES + l] = v0, v1, v2
        s[F * LANES + l] = s[BODY * LANES + l] * v0
        s[(F + 1) * LANES + l] = s[BODY * LANES + l] * v1
        s[(F + 2) * LANES + l] = s[(BODY + 1) * LANES + l] * v2
        s[BITS * LANES + l] = 1.0
        s[LEANS * LANES + l] = s[(LEANS + 1) * LANES + l] = s[LESS * LANES + l] = 0.0
        s[W * LANES + l] = s[(W + 1) * LANES + l] = s[(W + 2) * LANES + l] = 0.0
        pull += 1 if s[PULL * LANES + l] < 0.0 else 0
    return pull


@njit(cache=True, error_model="numpy")
def _changed(s: np.ndarray, n: int) -> int:
    """Lanes in which another wheel slides, or one less, than a step before."""
    change = 0
    for l in range(n):
        change += 1 if s[STICKS * LANES + l] != s[BITS * LANES + l] else 0
    return change


@njit(cache=True, error_model="numpy")
def _missing(s: np.ndarray, l: int, fx: float, fy: float, mz: float) -> tuple[float, float, float]:
    """The plate's force, turned into the base's axes about its origin, less that of the wheels of lane l."""
    yaw = s[(X + 2) * LANES + l]
    c, across = 1.0 - 0.5 * yaw * yaw, s[X * LANES + l] * fy - s[(X + 1) * LANES + l] * fx
    return (
        c * fx + yaw * fy - s[F * LANES + l],
        c * fy - yaw * fx - s[(F + 1) * LANES + l],
        mz - across - s[(F + 2) * LANES + l],
    )


@njit(cache=True, error_model="numpy")
def _corrected(s: np.ndarray, fx: float, fy: float, mz: float, h: float, n: int) -> None:
    """The correction of the next step, by P and what wheels miss of the plate's force."""
    for l in range(n):
        gain = s[(BODY + 2) * LANES + l] * h
        r0, r1, r2 = _missing(s, l, fx, fy, mz)
        r0, r1, r2 = gain * r0, gain * r1, gain * r2
        p0, p1, p2 = s[P * LANES + l], s[(P + 1) * LANES + l], s[(P + 2) * LANES + l]
        p3, p4, p5 = s[(P + 3) * LANES + l], s[(P + 4) * LANES + l], s[(P + 5) * LANES + l]
        s[DX * LANES + l] = p0 * r0 + p1 * r1 + p2 * r2
        s[(DX + 1) * LANES + l] = p1 * r0 + p3 * r1 + p4 * r2
        s[(DX + 2) * LANES + l] = p2 * r0 + p4 * r1 + p5 * r2


@njit(cache=True, error_model="numpy")
def _judged(s: np.ndarray, u: np.ndarray, dt: float, n: int) -> None:
    """What n lanes miss of the plate's force in the drive u (13,), and dt [s] of it added to how unlikely they are."""
    if s[NOISE * LANES] == 0.0:
        return
    for l in range(n):
        r0, r1, r2 = _missing(s, l, u[PLATE], u[PLATE + 1], u[PLATE + 2])
        r0, r1 = r0 * s[NOISE * LANES + l], r1 * s[(NOISE + 1) * LANES + l]
        r2 *= s[(NOISE + 2) * LANES + l]
        s[MISSED * LANES + l], s[(MISSED + 1) * LANES + l], s[(MISSED + 2) * LANES + l] = r0, r1, r2
        s[UNLIKELY * LANES + l] += dt * np.log((1.0 + r0 * r0) * (1.0 + r1 * r1) * (1.0 + r2 * r2))


@njit(cache=True, error_model="numpy")
def _ended(s: np.ndarray, u: np.ndarray, M: np.ndarray, h: float, n: int) -> None:
    """Accelerations by what the force leaves of the drive, positions and velocities a step on; M without wheels."""
    c00, c01, c02, c11, c12, c22, i = cofactors(M)
    wx, wy, wz = u[0], u[1], u[2]
    for l in range(n):
        b0 = wx - s[F * LANES + l] - s[W * LANES + l]
        b1 = wy - s[(F + 1) * LANES + l] - s[(W + 1) * LANES + l]
        b2 = wz - s[(F + 2) * LANES + l] - s[(W + 2) * LANES + l]
        a0 = (c00 * b0 + c01 * b1 + c02 * b2) * i
        a1 = (c01 * b0 + c11 * b1 + c12 * b2) * i
        a2 = (c02 * b0 + c12 * b1 + c22 * b2) * i
        s[ACCELERATION * LANES + l], s[(ACCELERATION + 1) * LANES + l], s[(ACCELERATION + 2) * LANES + l] = a0, a1, a2
        dx, dy, turn = s[D * LANES + l], s[(D + 1) * LANES + l], s[(D + 2) * LANES + l]
        yaw = s[(X + 2) * LANES + l] + 0.5 * turn
        q = yaw * yaw
        c, sine = 1.0 - 0.5 * q * (1.0 - q / 12.0), yaw * (1.0 - q / 6.0)
        s[X * LANES + l] += c * dx - sine * dy
        s[(X + 1) * LANES + l] += c * dy + sine * dx
        s[(X + 2) * LANES + l] += turn
        s[V * LANES + l] += h * a0
        s[(V + 1) * LANES + l] += h * a1
        s[(V + 2) * LANES + l] += h * a2


@njit(cache=True, error_model="numpy")
def _advance(  # noqa: PLR0913
    s: np.ndarray, wheels: np.ndarray, own: np.ndarray, drive: np.ndarray, inertia: np.ndarray, h: float, n: int
) -> None:
    """`advance` with all arrays of the bases flat; own M (6,) of the wheels."""
    M = inertia[:6] - own
    for l in range(LANES):
        s[SLID * LANES + l] = 0.0
    for k in range(len(drive)):
        u = drive[k]
        if _begun(s, u, inertia, h, n) > 0:
            for l in range(n):
                if s[PULL * LANES + l] < 0.0:
                    lifted(wheels, s, l)
                    s[PULL * LANES + l] = 0.0
        on_wheels(wheels, s, u, h, n)
        if s[(BODY + 2) * LANES] > 0.0:
            if _changed(s, n) > 0:
                for l in range(n):
                    if s[STICKS * LANES + l] != s[BITS * LANES + l]:
                        s[STICKS * LANES + l] = s[BITS * LANES + l]
                        corrector(wheels, l, s[(BODY + 3) * LANES + l], s)
            _corrected(s, u[PLATE], u[PLATE + 1], u[PLATE + 2], h, n)
        _ended(s, u, M, h, n)
    _judged(s, drive[len(drive) - 1], h * len(drive), n)


@njit(cache=True, error_model="numpy")
def advance(state: np.ndarray, wheels: np.ndarray, drive: np.ndarray, inertia: np.ndarray, h: float, n: int) -> None:
    """One sample on, the first n lanes of a group: states and deflections are changed.

    Args:
        state: (ROWS, LANES); wheels that slid are counted in row SLID.
        wheels: (m, WHEEL, LANES).
        drive: (k, 13) at k steps of h [s]: w, (-Fz, My, -Mx), (rx, ry), plate's force, how (rx, ry) accelerate.
        inertia: (15,) M's six elements (row by row, upper) and what an acceleration adds to (-Fz, My, -Mx), (3, 3).
        h: [s].
        n: A multiple of VECTOR.
    """
    flat = wheels.reshape(-1)
    yielding(flat, h, n)
    _advance(state.reshape(-1), flat, moving_wheels(flat), drive, inertia, h, n)


def simulated(  # noqa: PLR0913
    starts: np.ndarray, drive: np.ndarray, inertia: np.ndarray, bases: Bases, h: float, k: int, every: int = 1
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions (k, n, 3) [m, rad], shares of wheels that slid (k, n), and missing force over 2 sigma (k, n, 3).

    Of k bases in trials one after the other; no force is missing where no plate judges them.

    Args:
        starts: Sample at which each trial starts, and n.
        drive: (n steps, 13).
        inertia: (n, 15).
        bases: At rest: so each trial starts.
        h: Length of a step [s].
        k: How many of them.
        every: Samples of a trial, of which means are returned; what is left at its end is not.
    """
    first = np.cumsum([0, *(np.diff(starts) // every)])
    x, share, missed = np.empty((k, first[-1], 3)), np.empty((k, first[-1])), np.empty((k, first[-1], 3))
    side_by_side(
        lambda a, b, out: _simulated((x, share, missed), (a, b, out, every), drive, inertia, bases, h),
        starts[:-1], starts[1:], first[:-1],
    )  # fmt: skip
    return x, share, missed


@njit(cache=True, error_model="numpy")
def _simulated(
    found: tuple[np.ndarray, np.ndarray, np.ndarray],
    of: tuple[int, int, int, int],
    drive: np.ndarray,
    inertia: np.ndarray,
    bases: Bases,
    h: float,
) -> None:
    """One trial of what `simulated` finds: its first sample, its end, its first mean, samples of a mean."""
    a, b, out, every = of
    x, share, missed = found
    k, m, steps = len(x), bases.wheels.shape[1], len(drive) // len(inertia)
    total = np.zeros(4 * LANES)
    for g in range(len(bases.lanes)):
        lanes = bases.lanes[g]
        state, wheels = bases.state[g].copy().reshape(-1), bases.wheels[g].copy().reshape(-1)
        yielding(wheels, h, lanes)
        deflect_at_rest(wheels, drive[a * steps], lanes)
        own = moving_wheels(wheels)
        for t in range(a, b):
            _advance(state, wheels, own, drive[t * steps : (t + 1) * steps], inertia[t], h, lanes)
            for l in range(3 * LANES):
                total[l] += state[X * LANES + l]
            for l in range(LANES):
                total[3 * LANES + l] += state[SLID * LANES + l]
            done = t + 1 - a
            if done % every == 0:
                at = out + done // every - 1
                for l in range(min(lanes, k - LANES * g)):
                    share[LANES * g + l, at] = total[3 * LANES + l] / (m * steps * every)
                    for i in range(3):
                        x[LANES * g + l, at, i] = total[i * LANES + l] / every
                        missed[LANES * g + l, at, i] = state[(MISSED + i) * LANES + l]
                for l in range(4 * LANES):
                    total[l] = 0.0
        for l in range(4 * LANES):
            total[l] = 0.0
