"""Links of a robot in one implicit step: all forces balance at once, compiled.

    m_i(delta_i) + sum_j (M_ij (r_j - r_j0) / h + G_ij delta_j) = tau_i + f_c,i Sgn(u_i) + f_v,i u_i
    delta_i = delta_i0 + h r_i,     u_i = dq_i / h - r_i       r_i how fast link i falls behind, u_i how fast it is

Newton's steps for all links come to that in two or three: the mesh is linear on each side of a flank, a link that rests
is left out until its friction is exceeded, and one whose velocity changes its sign rests. Where they find no end links
are swept through one by one (Gauss-Seidel), each by what the others do in the same step, and tried again from there.
Sweeps alone are slow: arm_2 and arm_3 of an arm that is stretched out share nine tenths of their inertia, and two of
them take more of an oscillation out of these than their meshes do.
Reference: Acary, Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, 2008, ch. 12 and 13.
"""

from typing import NamedTuple

import numpy as np

from calibration.numerics.compiled import njit
from calibration.stages.drive_trains.kernel.link_motion import contact, mesh, stepped

SWEEPS = 2
_ROUNDS = 8  # Newton's steps
_ENOUGH = 1e-11, 1e-9  # [rad/s] and share of it, by which the last one changes a velocity


class Step(NamedTuple):
    """A step of m links.

    Attributes:
        speed: (m,) of their motors [rad/s].
        load: (m,) tau at its end [N.m].
        M: (m, m) inertia [kg.m2].
        G: (m, m) stiffness [N.m/rad].
    """

    speed: np.ndarray
    load: np.ndarray
    M: np.ndarray
    G: np.ndarray


class Meshes(NamedTuple):
    """What does not change from step to step, of m links.

    Attributes:
        order: (m,) in which they are swept through.
        moves: (m,) those that move; others are play operators.
        free: (m,) those of them whose own inertia counts, so that all forces together have a balance.
        values: (m, 7) of their drives.
    """

    order: np.ndarray
    moves: np.ndarray
    free: np.ndarray
    values: np.ndarray


@njit(cache=True, error_model="numpy")
def moved(new: np.ndarray, links: np.ndarray, step: Step, h: float, meshes: Meshes) -> None:
    """Links (m, 3) after h [s] into `new`."""
    new[:] = links
    if (meshes.free == meshes.moves).all() and balanced(new, links, step, h, meshes):
        return
    swept(new, links, step, h, meshes)
    balanced(new, links, step, h, meshes)


@njit(cache=True, error_model="numpy")
def swept(new: np.ndarray, links: np.ndarray, step: Step, h: float, meshes: Meshes) -> None:
    """The same by sweeps: each link first by what those before it do, then by those after it, too."""
    m, values = len(links), meshes.values
    new[:] = links
    acceleration = np.zeros(m)
    for _ in range(SWEEPS):
        for i in meshes.order:
            if not meshes.moves[i]:
                continue
            torque = step.load[i]
            for j in range(m):
                torque -= step.G[i, j] * new[j, 0]
                if j != i:
                    torque -= step.M[i, j] * acceleration[j]
            x, rate, slider = links[i]
            new[i] = stepped(x, rate, slider, h * step.speed[i], torque, step.M[i, i], h, contact(values[i]))
            acceleration[i] = (new[i, 1] - rate) / h


@njit(cache=True, error_model="numpy")
def balanced(new: np.ndarray, links: np.ndarray, step: Step, h: float, meshes: Meshes) -> bool:
    """The same all at once, from rates in `new`; whether an end was found, else `new` is left.

    Those that are not free stay as `new` has them.
    """
    m, found, free, values = len(links), False, meshes.free, meshes.values
    A, F, tried = np.empty((m, m)), np.empty(m), np.empty((2, m))
    for i in range(m):
        tried[0, i], tried[1, i] = new[i, 1], np.sign(step.speed[i] - new[i, 1])
    for _ in range(_ROUNDS):
        for i in range(m):
            F[i] = _row(A[i], i, tried, links, step, h, values[i]) if free[i] else 0.0
            for j in range(m):
                if not (free[i] and free[j]):
                    A[i, j] = 1.0 if i == j else 0.0
        if not _solved(A, F):
            return False
        found = _taken(tried, F, step.speed)
        if found:
            break
    for i in range(m if found else 0):
        if free[i]:
            _at_rate(new[i], links[i], tried[0, i], h, values[i])
    return found


@njit(cache=True, error_model="numpy")
def _at_rate(new: np.ndarray, link: np.ndarray, rate: float, h: float, values: np.ndarray) -> None:
    """A link (3,) after h [s] at a rate."""
    c = contact(values)
    new[0], new[1] = link[0] + h * rate, rate
    if c.slip > 0.0:
        new[2] = min(max(link[2], new[0] - c.reach), new[0] + c.reach)


@njit(cache=True, error_model="numpy")
def _row(
    A: np.ndarray, i: int, tried: np.ndarray, links: np.ndarray, step: Step, h: float, values: np.ndarray
) -> float:
    """What is left of link i's balance at rates tried[0], and how it grows with each, A (m,).

    tried[1] are signs of the links' velocities; 0: at rest, which ends where friction is exceeded.
    """
    rate, c = tried[0, i], contact(values)
    u = step.speed[i] - rate
    force, slope = mesh(links[i, 0] + h * rate, rate, links[i, 2], h, c)
    left = force - step.load[i] - c.viscous * u
    for j in range(len(links)):
        M, G = step.M[i, j], step.G[i, j]
        left += M * (tried[0, j] - links[j, 1]) / h + G * (links[j, 0] + h * tried[0, j])
        A[j] = M / h + G * h
    A[i] += slope + c.viscous
    if tried[1, i] == 0.0 and abs(left) > c.coulomb:
        tried[1, i] = 1.0 if left > 0.0 else -1.0
    if tried[1, i] == 0.0:
        A[:] = 0.0
        A[i] = 1.0
        return -u
    return left - c.coulomb * tried[1, i]


@njit(cache=True, error_model="numpy")
def _taken(tried: np.ndarray, by: np.ndarray, speed: np.ndarray) -> bool:
    """Take a step `by` (m,) off the rates; whether it was none, and no link came to rest."""
    small, share = _ENOUGH
    done = True
    for i in range(len(by)):
        tried[0, i] -= by[i]
        done = done and abs(by[i]) <= small + share * abs(tried[0, i])
        if tried[1, i] * (speed[i] - tried[0, i]) < 0.0:
            tried[1, i], tried[0, i], done = 0.0, speed[i], False
    return done


@njit(cache=True, error_model="numpy")
def _solved(A: np.ndarray, b: np.ndarray) -> bool:
    """Solve A x = b in place of b (m,), by elimination without pivots; False where one is not positive."""
    m = len(b)
    for i in range(m):
        if not A[i, i] > 0.0:
            return False
        for j in range(i + 1, m):
            share = A[j, i] / A[i, i]
            if share != 0.0:
                for k in range(i, m):
                    A[j, k] -= share * A[i, k]
                b[j] -= share * b[i]
    for i in range(m - 1, -1, -1):
        for j in range(i + 1, m):
            b[i] -= A[i, j] * b[j]
        b[i] /= A[i, i]
    return True
