"""Motion of a link behind its drive's dead zone, compiled: how far the motor is ahead of the link.

    delta = q_m - q_l                        I (ddq_m - d2 delta / dt2) = m(delta) - (tau - I ddq_m) - f
    m(delta) = [(dz(delta; g) + T dz') / c] + j   dz = delta - g beyond g, delta + g below -g, 0 between
    [.]                                      0 where it would pull the link back to the flank that it leaves
    j = k (delta - s), |j| <= t              a spring in series with a slider, s moves while |j| = t  (Jenkins element)
    f = f_c Sgn(dq_l) + f_v dq_l             Sgn(0) anything from -1 to 1

g half of the backlash [rad], c compliance [rad/(N.m)], T relaxation time of the contact [s], tau the torque of the
link's motion if it followed the motor, I the inertia the mesh moves. t = 0 is a plain dead zone, whose side the load
decides; with friction in the mesh and more of it at the link, motion decides. Implicit Euler steps: the link's
velocity u after a step is the root of a piecewise linear monotone equation, which jumps where a flank is struck, so
that stiction is exact and no step is too long to be stable.

Without inertia and with t = 0, delta is a play operator whose limits move with the torque,

    delta <- clip(delta + change of q_m, D(tau' - f_c), D(tau' + f_c))     tau' = tau + f_v dq_m, D(x) = c x + g sign(x)

Reference: Lampaert, Al-Bender, Swevers, IEEE MMAR 2003 (Maxwell-slip elements).
"""

from typing import NamedTuple

import numpy as np

from calibration.numerics.compiled import njit

HALF_GAP, COMPLIANCE, COULOMB, VISCOUS, RELAXATION, SPRING, SLIP = range(7)  # order of `values`
LIGHT = 1e-5  # [kg.m2] least inertia
_STEPS = 60  # Newton's, or halves of the interval where one leaves it: forces jump where a flank is struck
_ENOUGH = 1e-13  # [rad/s] by which the last one changes a velocity
STILL = 3e-5  # [rad] between two samples: one step will do


class Drive(NamedTuple):
    """Samples of a motor and what loads it, each (n,).

    Attributes:
        t: [s].
        q: Motor positions [rad].
        v: Motor velocities [rad/s].
        torque: [N.m].
        inertia: [kg.m2].
        coupled: Torque by other links, even over the interval that ends at a sample [N.m].
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    torque: np.ndarray
    inertia: np.ndarray
    coupled: np.ndarray


@njit(cache=True, error_model="numpy")
def deflection(torque: float, half_gap: float, compliance: float) -> float:
    """D(torque) [rad] of a mesh in contact; 0 without torque, where any delta inside the gap is at rest."""
    if torque > 0.0:
        return compliance * torque + half_gap
    if torque < 0.0:
        return compliance * torque - half_gap
    return 0.0


class Contact(NamedTuple):
    """`values` as a step needs them: g, 1 / c, T / c, f_c, f_v, k, t, t / k."""

    half_gap: float
    stiffness: float
    damping: float
    coulomb: float
    viscous: float
    spring: float
    slip: float
    reach: float


@njit(cache=True, error_model="numpy")
def contact(values: np.ndarray) -> Contact:
    """The contact of `values` (7,)."""
    k = 1.0 / values[1]
    return Contact(values[0], k, k * values[4], values[2], values[3], values[5], values[6], values[6] / values[5])


@njit(cache=True, error_model="numpy")
def mesh(x: float, rate: float, slider: float, h: float, c: Contact) -> tuple[float, float]:
    """m [N.m] at delta x and its rate, and how it falls with the link's velocity over a step h [N.m.s/rad]."""
    force, slope = 0.0, 0.0
    if abs(x) > c.half_gap:
        flank = c.half_gap if x > 0.0 else -c.half_gap
        force, slope = c.stiffness * (x - flank) + c.damping * rate, c.stiffness * h + c.damping
        if force * x < 0.0:
            force, slope = 0.0, 0.0
    if c.slip > 0.0:
        j = c.spring * (x - slider)
        force += min(max(j, -c.slip), c.slip)
        if abs(j) <= c.slip:
            slope += c.spring * h
    return force, slope


@njit(cache=True, error_model="numpy")
def stepped(
    x: float, rate: float, s: float, dq: float, torque: float, inertia: float, h: float, c: Contact
) -> tuple[float, float, float]:
    """Delta [rad], its rate [rad/s] and s [rad] after h [s] in which the motor moves by dq [rad]."""
    push, v = inertia / h, dq / h
    load, at = torque - push * (v - rate), x + dq
    damping = push + c.viscous
    u = 0.0
    force, slope = mesh(at, v, s, h, c)
    if abs(force - load) > c.coulomb:
        load += c.coulomb if force > load else -c.coulomb
        left = force - load
        low, high = min(0.0, 1.01 * left / damping), max(0.0, 1.01 * left / damping)
        for _ in range(_STEPS):
            if left > 0.0:
                low = u
            else:
                high = u
            step = left / (slope + damping)
            if abs(step) > _ENOUGH and not low < u + step < high:
                step = 0.5 * (low + high) - u
            u += step
            if abs(step) <= _ENOUGH + 1e-12 * abs(u):
                break
            force, slope = mesh(at - h * u, v - u, s, h, c)
            left = force - load - damping * u
    x = at - h * u
    if c.slip > 0.0:
        s = min(max(s, x - c.reach), x + c.reach)
    return x, v - u, s


@njit(cache=True, error_model="numpy")
def along(p: float, r: float, d: float, s: float) -> float:
    """How far a motor is [rad] after a share s of d on the cubic that begins with the slope p and ends with r."""
    return s * (p + s * (3.0 * d - 2.0 * p - r + s * (p + r - 2.0 * d)))


@njit(cache=True, error_model="numpy")
def advanced(
    x: float, rate: float, slider: float, a: Drive, i: int, b: Drive, j: int, longest: float, c: Contact
) -> tuple[float, float, float]:
    """Delta, its rate and s moved from sample i of a to sample j of b.

    In between the motor moves as the cubic through positions and velocities, torque and inertia change evenly; steps
    are no longer than `longest` [s].
    """
    dt = b.t[j] - a.t[i]
    n = max(1, int(np.ceil(dt / longest - 1e-6)))
    p, r, d, before = a.v[i] * dt, b.v[j] * dt, b.q[j] - a.q[i], 0.0
    torque, inertia = a.torque[i] + b.coupled[j], a.inertia[i]
    more, heavier = b.torque[j] - a.torque[i], b.inertia[j] - inertia
    if abs(d) < STILL and abs(p) < STILL and abs(r) < STILL and abs(rate) * dt < STILL:
        n = 1
    for k in range(n):
        s = (k + 1) / n
        at = along(p, r, d, s)
        x, rate, slider = stepped(x, rate, slider, at - before, torque + s * more, inertia + s * heavier, dt / n, c)
        before = at
    return x, rate, slider


@njit(cache=True, error_model="numpy")
def simulated(drive: Drive, begins: np.ndarray, starts: np.ndarray, longest: float, values: np.ndarray) -> np.ndarray:
    """delta (n,) [rad] of one joint in trials in a row.

    `begins` (m + 1,) are their first samples and n, `starts` (m,) delta there [rad], at rest; steps as of `advanced`.
    `values` (7,) are g, c, f_c, f_v, T, k, t.
    """
    out, c = np.empty(len(drive.q)), contact(values)
    for m in range(len(starts)):
        x, rate, slider = starts[m], 0.0, starts[m]
        out[begins[m]] = x
        for i in range(begins[m], begins[m + 1] - 1):
            x, rate, slider = advanced(x, rate, slider, drive, i, drive, i + 1, longest, c)
            out[i + 1] = x
    return out


@njit(cache=True, error_model="numpy")
def carried(delta: float, drive: Drive, i: int, values: np.ndarray) -> float:
    """delta [rad] clipped to what the play operator holds at sample i."""
    t = drive.torque[i] + drive.coupled[i] + values[3] * drive.v[i]
    low, high = deflection(t - values[2], values[0], values[1]), deflection(t + values[2], values[0], values[1])
    return min(max(delta, low), high)


@njit(cache=True, error_model="numpy")
def played(drive: Drive, begins: np.ndarray, starts: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The play operator: delta (n,) [rad] without the link's inertia, trials as in `simulated`."""
    out = np.empty(len(drive.q))
    for m in range(len(starts)):
        out[begins[m]] = starts[m]
        for i in range(begins[m] + 1, begins[m + 1]):
            out[i] = carried(out[i - 1] + drive.q[i] - drive.q[i - 1], drive, i, values)
    return out
