"""Motion of a link behind its drive's dead zone, compiled: how far the motor is ahead of the link.

    delta = q_m - q_l                        I (ddq_m - d2 delta / dt2) = m(delta) - (tau - I ddq_m) - f
    m(delta) = (dz(delta; g) + T dz') / c + j     dz = delta - g beyond g, delta + g below -g, 0 between
    j = k (delta - s), |j| <= t              a spring in series with a slider, s moves while |j| = t  (Jenkins element)
    f = f_c Sgn(dq_l) + f_v dq_l             Sgn(0) anything from -1 to 1

g half of the backlash [rad], c compliance [rad/(N.m)], T relaxation time of the contact [s], tau the torque of the
link's motion if it followed the motor, I the inertia the mesh moves. t = 0 is a plain dead zone, whose side the load
decides; with friction in the mesh and more of it at the link, motion decides. Implicit Euler steps: the link's
velocity u after a step is the root of a piecewise linear monotone equation, so that stiction is exact and no step is
too long to be stable.

Without inertia and with t = 0, delta is a play operator whose limits move with the torque,

    delta <- clip(delta + change of q_m, D(tau' - f_c), D(tau' + f_c))     tau' = tau + f_v dq_m, D(x) = c x + g sign(x)

Reference: Lampaert, Al-Bender, Swevers, IEEE MMAR 2003 (Maxwell-slip elements).
"""

from typing import NamedTuple

import numpy as np
from numba import njit

HALF_GAP, COMPLIANCE, COULOMB, VISCOUS, RELAXATION, SPRING, SLIP = range(7)  # order of `values`
_NEWTON = 12
_STILL = 3e-5  # [rad] between two samples: one step will do


class Drive(NamedTuple):
    """Samples of a motor and what loads it, each (n,).

    Attributes:
        t: [s].
        q: Motor positions [rad].
        v: Motor velocities [rad/s].
        torque: [N.m].
        inertia: [kg.m2].
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    torque: np.ndarray
    inertia: np.ndarray


@njit(cache=True, error_model="numpy")
def deflection(torque: float, half_gap: float, compliance: float) -> float:
    """D(torque) [rad] of a mesh in contact; 0 without torque, where any delta inside the gap is at rest."""
    if torque > 0.0:
        return compliance * torque + half_gap
    if torque < 0.0:
        return compliance * torque - half_gap
    return 0.0


@njit(cache=True, error_model="numpy")
def mesh(x: float, rate: float, slider: float, h: float, values: np.ndarray) -> tuple[float, float]:
    """m [N.m] at delta x and its rate, and how it falls with the link's velocity over a step h [N.m.s/rad]."""
    g, k, t = values[0], 1.0 / values[1], values[6]
    d, force, slope = k * values[4], 0.0, 0.0
    if x > g:
        force, slope = k * (x - g) + d * rate, k * h + d
    elif x < -g:
        force, slope = k * (x + g) + d * rate, k * h + d
    if t > 0.0:
        j = values[5] * (x - slider)
        force += min(max(j, -t), t)
        if abs(j) <= t:
            slope += values[5] * h
    return force, slope


@njit(cache=True, error_model="numpy")
def stepped(state: np.ndarray, dq: float, torque: float, inertia: float, h: float, values: np.ndarray) -> None:
    """Move `state` (3,), delta [rad], its rate [rad/s] and s [rad], by h [s] in which the motor moves by dq [rad]."""
    push, v, s = inertia / h, dq / h, state[2]
    load, at = torque - push * (v - state[1]), state[0] + dq
    damping = push + values[3]
    u, before = 0.0, -1.0
    force, slope = mesh(at, v, s, h, values)
    if abs(force - load) > values[2]:
        load += values[2] if force > load else -values[2]
        for _ in range(_NEWTON):
            change = (force - load - damping * u) / (slope + damping)
            u += change
            if slope == before and abs(change) <= 1e-12 + 1e-9 * abs(u):
                break
            before = slope
            force, slope = mesh(at - h * u, v - u, s, h, values)
    state[0], state[1] = at - h * u, v - u
    if values[6] > 0.0:
        reach = values[6] / values[5]
        state[2] = min(max(s, state[0] - reach), state[0] + reach)


@njit(cache=True, error_model="numpy")
def advanced(state: np.ndarray, a: Drive, i: int, b: Drive, j: int, longest: float, values: np.ndarray) -> None:
    """Move `state` from sample i of a to sample j of b.

    In between the motor moves as the cubic through positions and velocities, torque and inertia change evenly; steps
    are no longer than `longest` [s].
    """
    dt = b.t[j] - a.t[i]
    n = max(1, int(np.ceil(dt / longest - 1e-6)))
    p, r, d, before = a.v[i] * dt, b.v[j] * dt, b.q[j] - a.q[i], 0.0
    if abs(d) < _STILL and abs(p) < _STILL and abs(r) < _STILL and abs(state[1]) * dt < _STILL:
        n = 1
    for k in range(n):
        s = (k + 1) / n
        at = s * (p + s * (3.0 * d - 2.0 * p - r + s * (p + r - 2.0 * d)))
        torque = a.torque[i] + s * (b.torque[j] - a.torque[i])
        inertia = a.inertia[i] + s * (b.inertia[j] - a.inertia[i])
        stepped(state, at - before, torque, inertia, dt / n, values)
        before = at


@njit(cache=True, error_model="numpy")
def simulated(drive: Drive, begins: np.ndarray, starts: np.ndarray, longest: float, values: np.ndarray) -> np.ndarray:
    """delta (n,) [rad] of one joint in several trials in a row.

    `begins` (m + 1,) are their first samples and n, `starts` (m,) delta there [rad], at rest; steps as of `advanced`.
    `values` (7,) are g, c, f_c, f_v, T, k, t.
    """
    out, state = np.empty(len(drive.q)), np.empty(3)
    for m in range(len(starts)):
        state[0], state[1], state[2] = starts[m], 0.0, starts[m]
        out[begins[m]] = starts[m]
        for i in range(begins[m], begins[m + 1] - 1):
            advanced(state, drive, i, drive, i + 1, longest, values)
            out[i + 1] = state[0]
    return out


@njit(cache=True, error_model="numpy")
def carried(delta: float, drive: Drive, i: int, values: np.ndarray) -> float:
    """delta [rad] clipped to what the play operator holds at sample i."""
    t = drive.torque[i] + values[3] * drive.v[i]
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


@njit(cache=True, error_model="numpy")
def stream(
    states: np.ndarray, a: Drive, b: Drive, offs: np.ndarray, longest: float, values: np.ndarray, plays: np.ndarray
) -> None:
    """Move states (m, c, 3) of m joints from samples a to b, (m,) each: c runs with torques off by offs (m, c).

    `plays` (m,): the joint is a play operator.
    """
    for j in range(states.shape[1]):
        before = Drive(a.t, a.q, a.v, a.torque + offs[:, j], a.inertia)
        after = Drive(b.t, b.q, b.v, b.torque + offs[:, j], b.inertia)
        for i in range(states.shape[0]):
            if plays[i]:
                moved = states[i, j, 0] + b.q[i] - a.q[i]
                states[i, j, 0] = carried(moved, after, i, values[i])
            else:
                advanced(states[i, j], before, i, after, i, longest, values[i])
