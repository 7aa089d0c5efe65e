"""A base that sticks and slips, and links that strike in their gaps on it, moved together: each throws the other.

    M_b a_b = w - wheels + sum_i P_i d2 delta_i / dt2            a_0 what the base does if links follow their motors
    tau_i <- tau_i + R_i' a_0,    M_ij <- M_ij - R_i' M_b^-1 P_j              P_i base x link i of the robot's inertia

w of inverse dynamics by motors, delta_i how far link i is behind, tau_i its load on a base that does not accelerate in
the floor's plane, M_b without the wheels, which stick. Simulated one after the other, each along a whole trial, they do
not converge: an arm stretched out that strikes in its gap turns the base, and is turned by it, by nearly as much as it
would turn alone. Within a step of the base the force of its wheels is known, so that the second line is exact: links
move with the inertia that is left them by a base that yields, and then the base does. R = P but for what hangs on the
wrist's sensor, which accelerates links, and shows by its reading, not by P and M_b, what it does to the base.
"""

from typing import NamedTuple

import numpy as np

from calibration.numerics.compiled import njit
from calibration.stages.drive_trains.drive_train import LONGEST
from calibration.stages.drive_trains.kernel.link_motion import LIGHT
from calibration.stages.drive_trains.kernel.link_streams import INERTIA, TORQUE, Drives, streamed
from calibration.stages.stick_slip.kernel.bases import ACCELERATION, STEPS, VELOCITY, Bases, X
from calibration.stages.stick_slip.kernel.corrector import solved
from calibration.stages.stick_slip.kernel.integration import advance
from calibration.stages.stick_slip.kernel.wheel_forces import deflect_at_rest, moving_wheels

_LEFT = 0.05  # least share of its inertia that a base leaves a link: both inertias are estimates


class Carried(NamedTuple):
    """Links along the s steps of a base, m drive trains of k joints.

    Attributes:
        states: (m, 1, 3) at the start.
        samples: (s, 4, m) as `link_streams` take them.
        row: (s,) which of n samples of what follows is that of a step.
        M: (n, k, k) inertia.
        G: (n, k, k) stiffness.
        P: (n, m, 3) Fx, Fy, Mz that accelerate the robot as each link does by 1 rad/s2, in the base's axes.
        R: (n, m, 3) the same of what loads the links.
        drives: Their parameters.
    """

    states: np.ndarray
    samples: np.ndarray
    row: np.ndarray
    M: np.ndarray
    G: np.ndarray
    P: np.ndarray
    R: np.ndarray
    drives: Drives


@njit(cache=True, error_model="numpy")
def walked(
    bases: Bases, drive: np.ndarray, inertia: np.ndarray, links: Carried, h: float
) -> tuple[np.ndarray, np.ndarray]:
    """x, y, yaw (n, 3) of the first of `bases`, at rest, and delta (s, m) of links after each step of h [s].

    Drive (s, 13) of the motors and inertia (n, 15) are as of `integration.advance`; states of links are changed.
    """
    state, wheels, lanes = bases.state[0].copy(), bases.wheels[0].copy(), bases.lanes[0]
    deflect_at_rest(wheels.reshape(-1), drive[0], lanes)
    x, delta, a = np.empty((len(inertia), 3)), np.empty((len(drive), len(links.states))), np.empty(3)
    own, sample, states, before = moving_wheels(wheels.reshape(-1)), np.empty(15), links.states, links.samples[0]
    for k in range(len(drive)):
        sample[:] = inertia[k // STEPS]
        advance(state, wheels, drive[k : k + 1], sample, h, lanes)
        for c in range(3):
            a[c] = state[ACCELERATION + c, 0]
        row = links.row[k]
        after, M = links.samples[k].copy(), links.M[row].copy()
        yields = left(after, M, (links.P[row], links.R[row]), sample[:6] - own, a, links.drives.columns)
        if k > 0:
            thrown = streamed(states, before, after, M, links.G[row], h, LONGEST, links.drives)
            for c in range(3):
                more = 0.0
                for i in range(len(thrown)):
                    more += yields[i, c] * thrown[i]
                state[ACCELERATION + c] += more
                state[VELOCITY + c] += h * more
        before, delta[k] = after, states[:, 0, 0]
        if k % STEPS == STEPS - 1:
            x[k // STEPS] = state[X : X + 3, 0]
    return x, delta


@njit(cache=True, error_model="numpy")
def left(
    sample: np.ndarray, M: np.ndarray, shared: tuple[np.ndarray, np.ndarray], base: np.ndarray, a: np.ndarray,
    columns: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """A sample (4, m) of links, and M (k, k), become those on a base that yields; M_b^-1 P (m, 3) is returned.

    Shared are P and R (m, 3), M_b (6,) of the base, a_0 (3,), columns (m,) of the links in M.
    """
    P, R = shared
    m = len(P)
    yields = np.empty((m, 3))
    for i in range(m):
        yields[i, 0], yields[i, 1], yields[i, 2] = solved(base, P[i, 0], P[i, 1], P[i, 2])
    for i in range(m):
        for c in range(3):
            sample[TORQUE, i] += R[i, c] * a[c]
        whole = M[columns[i], columns[i]]
        for j in range(m):
            M[columns[i], columns[j]] -= R[i, 0] * yields[j, 0] + R[i, 1] * yields[j, 1] + R[i, 2] * yields[j, 2]
        if sample[INERTIA, i] > LIGHT:
            sample[INERTIA, i] *= max(M[columns[i], columns[i]] / whole, _LEFT)
    return yields
