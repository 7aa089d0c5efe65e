"""Drive trains of a robot moved together, compiled: sample by sample, or along a whole recording.

    tau_i <- tau_i - sum_k M_ik d2 delta_k / dt2 - sum_j G_ij delta_j          k all other links, j all of them

Within a step a link is moved by what the others do in the same step, see `balance`: all at once, or by sweeps from the
hand inwards. A link that strikes in its gap throws the link that carries it, and is thrown by it. The column that
carries the arm has no motor and no gap: how it leans about x and y, -delta, sways as links move, and moves them.
Reference: Jean, The non-smooth contact dynamics method, Comput. Methods Appl. Mech. Engrg. 1999 (sweeps over contacts).
"""

from typing import NamedTuple

import numpy as np

from calibration.numerics.compiled import njit
from calibration.robot.rigid_tree import RigidTree
from calibration.robot.tree_dynamics import TreeDynamics, sample
from calibration.stages.drive_trains.kernel.balance import Meshes, Step, moved
from calibration.stages.drive_trains.kernel.link_motion import (
    COMPLIANCE,
    LIGHT,
    STILL,
    Drive,
    advanced,
    along,
    carried,
    contact,
)

Q, V, TORQUE, INERTIA = range(4)  # rows of `samples`
RESTS = 5e-3  # [rad/s, m/s] below which a joint is at rest
Arrays = tuple[np.ndarray, ...]
Unnamed = tuple[Arrays, Arrays, Arrays, np.ndarray]  # RigidTree, Drives, TreeDynamics: faster to pass; scratch


class Drives(NamedTuple):
    """Drive trains made ready for single samples, m of them in a robot of k joints, and a column that bends or not.

    Attributes:
        columns: (m,) column of each in the readings; where the column bends then k and k + 1, its leans: so all of
            these have two more but inertials, link_inertia, motor and doubt.
        inwards: (m,) their numbers, those nearer to the hand first.
        values: (m, 7) as simulated.
        inertials: (m, p) of each load.
        link_inertia: (m,) [kg.m2].
        dynamic: (m,) whose links' inertia counts.
        offs: (m, c) error of the torque in each run [N.m].
        shifts: (m, c) that it winds a mesh up by [rad].
        motor: (m, 4) eccentricities [rad].
        plays: (m,) which are play operators.
        doubt: (m, 3) variance over the square of the interval in motion and at rest [-], and beside it [rad2].
        offset: (k,) zeros of all readings [rad, m].
        column: (2, 2) compliance [rad/(N.m)] and mean moment [N.m] of what carries the arm, see `torques.Column`.
    """

    columns: np.ndarray
    inwards: np.ndarray
    values: np.ndarray
    inertials: np.ndarray
    link_inertia: np.ndarray
    dynamic: np.ndarray
    offs: np.ndarray
    shifts: np.ndarray
    motor: np.ndarray
    plays: np.ndarray
    doubt: np.ndarray
    offset: np.ndarray
    column: np.ndarray


@njit(cache=True, error_model="numpy")
def loaded(
    tree: RigidTree, drives: Drives, root: np.ndarray, work: np.ndarray, found: TreeDynamics, moving: np.ndarray,
    samples: np.ndarray,
) -> None:  # fmt: skip
    """Dynamics of one sample into `found`, and what moves each link into `samples` (4, m).

    `moving` (3, k) are readings, velocities and accelerations, `root` and `work` as of `rigid_tree`.
    """
    angle, v, a = np.empty((1, moving.shape[1])), moving[1:2], moving[2:3]
    for j in range(moving.shape[1]):
        angle[0, j] = moving[0, j] - drives.offset[j]
    sample(tree, angle, v, a, root, work, found)
    x, y, z, p = root[0, 6], root[0, 7], root[0, 8], found.regressor.shape[2]
    M, (soft, mean) = found.moment[0], drives.column
    lean_x, lean_y = soft[0] * (mean[0] - M[0]), soft[1] * (mean[1] - M[1])
    for i in range(len(drives.motor), len(drives.columns)):
        c = drives.columns[i]
        samples[Q, i] = samples[V, i] = 0.0
        samples[TORQUE, i], samples[INERTIA, i] = M[c - moving.shape[1]], found.inertia[0, c, c]
    for i in range(len(drives.motor)):
        c, phi, pull = drives.columns[i], drives.inertials[i], found.coupling[0, drives.columns[i]]
        torque, inertia = found.torque[0, c] + drives.link_inertia[i] * a[0, c], found.inertia[0, c, c]
        for k in range(p):
            torque += found.regressor[0, c, k] * phi[k]
        tilt_x, tilt_y = pull[1] * z - pull[2] * y, pull[2] * x - pull[0] * z
        torque += tilt_x * (lean_x + phi[p] - M[0] * phi[p + 2]) + tilt_y * (lean_y + phi[p + 1] - M[1] * phi[p + 2])
        samples[Q, i], samples[V, i], samples[TORQUE, i] = moving[0, c], v[0, c], torque
        samples[INERTIA, i] = max(inertia + drives.link_inertia[i], LIGHT) if drives.dynamic[i] else LIGHT


@njit(cache=True, error_model="numpy")
def together(
    links: np.ndarray, a: np.ndarray, b: np.ndarray, M: np.ndarray, G: np.ndarray, dt: float, longest: float,
    drives: Drives,
) -> np.ndarray:  # fmt: skip
    """Move links (m, 3), that are no play operators, from samples a to b (4, m); mean accelerations of deltas (m,).

    M and G (k + 2, k + 2) are inertia and stiffness of all joints, and of the column, at b. Steps are no longer than
    `longest` [s].
    """
    m, rates = len(links), links[:, 1].copy()
    n = _steps(links, a, b, dt, longest)
    h, new, meshes = dt / n, links.copy(), Meshes(drives.inwards, ~drives.plays, drives.dynamic, drives.values)
    step = Step(np.empty(m), np.empty(m), _among(M, drives.columns), _among(G, drives.columns))
    for k in range(n):
        s, before = (k + 1) / n, k / n
        for i in range(m):
            p, r, d = a[V, i] * dt, b[V, i] * dt, b[Q, i] - a[Q, i]
            step.speed[i] = (along(p, r, d, s) - along(p, r, d, before)) / h
            step.load[i] = a[TORQUE, i] + s * (b[TORQUE, i] - a[TORQUE, i])
            step.M[i, i] = a[INERTIA, i] + s * (b[INERTIA, i] - a[INERTIA, i])
        moved(new, links, step, h, meshes)
        links[:] = new
    return (links[:, 1] - rates) / dt


@njit(cache=True, error_model="numpy")
def _steps(links: np.ndarray, a: np.ndarray, b: np.ndarray, dt: float, longest: float) -> int:
    """Number of steps from samples a to b (4, m): one where nothing moves."""
    for i in range(len(links)):
        moved = abs(b[Q, i] - a[Q, i]) + abs(a[V, i] * dt) + abs(b[V, i] * dt) + abs(links[i, 1]) * dt
        if moved >= STILL:
            return max(1, int(np.ceil(dt / longest - 1e-6)))
    return 1


@njit(cache=True, error_model="numpy")
def _among(A: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Rows and columns (m, m) of A (k + 2, k + 2)."""
    found = np.empty((len(columns), len(columns)))
    for i in range(len(columns)):
        for j in range(len(columns)):
            found[i, j] = A[columns[i], columns[j]]
    return found


@njit(cache=True, error_model="numpy")
def streamed(
    states: np.ndarray, before: np.ndarray, samples: np.ndarray, M: np.ndarray, G: np.ndarray, dt: float,
    longest: float, drives: Drives,
) -> np.ndarray:  # fmt: skip
    """Move states (m, c, 3) of m drive trains by dt [s] from samples `before` (4, m); c runs, torques off by `offs`.

    M and G as of `together`. The first runs, the likely ones, move together, and their mean accelerations (m,) are
    returned; each other one moves alone, loaded by what these do. The column has the first alone.
    """
    m, columns = samples.shape[1], drives.columns
    room = np.zeros((5, m))
    room[1] = dt
    a = Drive(room[0], before[Q], before[V], room[2], before[INERTIA], room[4])
    b = Drive(room[1], samples[Q], samples[V], room[3], samples[INERTIA], room[4])
    acceleration = together(states[:, 0], before, samples, M, G, dt, longest, drives)
    for i in range(len(drives.motor)):
        others, c = 0.0, contact(drives.values[i])
        for other in range(m):
            if other != i:
                others -= M[columns[i], columns[other]] * acceleration[other]
                others -= G[columns[i], columns[other]] * states[other, 0, 0]
        for j in range(0 if drives.plays[i] else 1, states.shape[1]):
            a.torque[i], b.torque[i] = before[TORQUE, i] + drives.offs[i, j], samples[TORQUE, i] + drives.offs[i, j]
            x = states[i, j]
            b.coupled[i] = others - G[columns[i], columns[i]] * x[0]
            if drives.plays[i]:
                x[0] = carried(x[0] + b.q[i] - a.q[i], b, i, drives.values[i])
            else:
                x[0], x[1], x[2] = advanced(x[0], x[1], x[2], a, i, b, i, longest, c)
    return acceleration


@njit(cache=True, error_model="numpy")
def walked(
    states: np.ndarray, t: np.ndarray, samples: np.ndarray, M: np.ndarray, G: np.ndarray, longest: float, drives: Drives
) -> np.ndarray:
    """delta (n, m, c) [rad] of states (m, c, 3), as of `streamed`, along samples (n, 4, m), t (n,); M, G of each."""
    found = np.empty((len(t), *states.shape[:2]))
    found[0] = states[:, :, 0]
    for k in range(1, len(t)):
        streamed(states, samples[k - 1], samples[k], M[k], G[k], t[k] - t[k - 1], longest, drives)
        found[k] = states[:, :, 0]
    return found


@njit(cache=True, error_model="numpy")
def link_angles(states: np.ndarray, moving: np.ndarray, drives: Drives, out: np.ndarray) -> None:
    """Angles (4, 1, k) behind readings and velocities, `moving` (3, k): likely, least, largest; variance."""
    q = moving[0]
    for j in range(len(q)):
        out[0, 0, j] = out[1, 0, j] = out[2, 0, j] = q[j]
        out[3, 0, j] = 0.0
    for i in range(len(drives.motor)):
        c, e = drives.columns[i], drives.motor[i]
        top, bottom, theta = -np.inf, np.inf, q[c] - drives.offset[c]
        for j in range(states.shape[1]):
            delta = states[i, j, 0] - drives.shifts[i, j]
            top, bottom = max(top, delta), min(bottom, delta)
        bare = q[c] - e[0] * np.cos(theta) - e[1] * np.sin(theta) - e[2] * np.cos(2 * theta) - e[3] * np.sin(2 * theta)
        out[0, 0, c] = bare - (states[i, 0, 0] - drives.shifts[i, 0])
        out[1, 0, c], out[2, 0, c] = bare - top, bare - bottom
        doubt = drives.doubt[i, 1] if abs(moving[1, c]) < RESTS else drives.doubt[i, 0]
        out[3, 0, c] = doubt * (top - bottom) ** 2 + drives.doubt[i, 2]


@njit(cache=True, error_model="numpy")
def borne(states: np.ndarray, drives: Drives, found: TreeDynamics) -> np.ndarray:
    """Moment (1, 2) under which the column at rest would lean as it does [N.m]; that on one that does not bend."""
    M, m = found.moment.copy(), len(drives.motor)
    for i in range(m, len(states)):
        M[0, i - m] = states[i, 0, 0] / drives.values[i, COMPLIANCE]
    return M


@njit(cache=True, error_model="numpy")
def advanced_drives(
    robot: Unnamed, root: np.ndarray, moving: np.ndarray, before: np.ndarray, states: np.ndarray, dt: float,
    longest: float,
) -> tuple[np.ndarray, ...]:  # fmt: skip
    """`loaded`, `streamed`, `link_angles` and `borne` of a sample dt [s] after one of samples `before` and states.

    Returns:
        Samples (4, m) and states of now, torque of all joints (1, k), `borne`, angles (4, 1, k).
    """
    tree, drives, found, work = RigidTree(*robot[0]), Drives(*robot[1]), TreeDynamics(*robot[2]), robot[3]
    now, samples, angles = states.copy(), np.empty_like(before), np.empty((4, 1, moving.shape[1]))
    loaded(tree, drives, root, work, found, moving, samples)
    streamed(now, before, samples, found.inertia[0], found.stiffness[0], dt, longest, drives)
    link_angles(now, moving, drives, angles)
    return samples, now, found.torque.copy(), borne(now, drives, found), angles
