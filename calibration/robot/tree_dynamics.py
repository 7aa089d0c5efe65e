"""Dynamics of a tree of rigid bodies on a moving root, compiled: one sample or all at once, in the root's axes.

    f_i = F_i + sum_children f_c     tau_i = S_i' f_i     M_ij = S_i' I^c_j S_j

i carries j, I^c_j what j carries; f_0 is the wrench on the root, see `rigid_tree`. What pushes the last body from
outside is taken off its F. The regressor is how tau changes with masses and first moments of the bodies, second moments
left alone. Reference: Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 5 and 6.
"""

from typing import NamedTuple

import numpy as np

from calibration.numerics.compiled import njit
from calibration.numerics.spatial import cross, dot, turned
from calibration.robot.rigid_tree import (
    ROW,
    A,
    F,
    I,
    P,
    R,
    RigidTree,
    S,
    V,
    X,
    move,
    place,
    scratch,
    stand,
    times,
    weigh,
)


class TreeDynamics(NamedTuple):
    """Dynamics of n samples; joints in the columns of q.

    Attributes:
        torque: (n, k) [N.m, N].
        inertia: (n, k, k) M, symmetric [kg.m2, kg.m, kg].
        root: (n, 6) wrench on the root [N, N.m].
        moment: (n, 2) about x and y of the first joint's frame, of the force it passes on [N.m].
        composite: (n, 6, 6) inertia of the whole about the root's origin.
        coupling: (n, k, 3) force on the root by unit acceleration of each joint.
        stiffness: (n, k, k) how tau grows with the joints' positions by what bodies weigh, symmetric [N.m, N].
        regressor: (n, k, 4 k) by mass, then first moments, body by body; (n, k, 0) where not asked for.
    """

    torque: np.ndarray
    inertia: np.ndarray
    root: np.ndarray
    moment: np.ndarray
    composite: np.ndarray
    coupling: np.ndarray
    stiffness: np.ndarray
    regressor: np.ndarray


def dynamics_along(
    tree: RigidTree, q: np.ndarray, v: np.ndarray, a: np.ndarray, root: np.ndarray, regressors: bool = False
) -> TreeDynamics:
    """Dynamics at positions [rad, m], velocities and accelerations (n, k) in the columns of the tree.

    `root` (n, 12) or (1, 12): twist of the root and its proper acceleration, linear first, in its axes; (n, 18): and
    what pushes the last body, in that body's axes about its origin.
    """
    found, (q, v, a) = room(len(q), q.shape[1], regressors), np.array([q, v, a], dtype=float)
    sample(tree, q, v, a, np.array(root, dtype=float, order="C"), scratch(tree), found)
    return found


def room(n: int, k: int, regressors: bool = False) -> TreeDynamics:
    """What dynamics of n samples of k joints are written to."""
    return TreeDynamics(
        np.empty((n, k)), np.zeros((n, k, k)), np.empty((n, 6)), np.empty((n, 2)), np.empty((n, 6, 6)),
        np.empty((n, k, 3)), np.zeros((n, k, k)), np.zeros((n, k, 4 * k if regressors else 0)),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _unit_forces(me: np.ndarray, out: np.ndarray) -> None:
    """Wrenches (4, 6) about the root's origin by unit mass and first moments of a body that moves: a(r) = a + B r."""
    B, axis, w, square = np.zeros((3, 3)), np.empty(3), np.empty(3), 0.0
    out[:] = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        w[i] = me[V + 3 + i]
        square += w[i] ** 2
        B[k, j], B[j, k] = me[A + 3 + i], -me[A + 3 + i]
    for i in range(3):
        B[i, i] -= square
        for c in range(3):
            B[i, c] += w[i] * w[c]
            out[0, i] += B[i, c] * me[P + c]
        out[0, i] += me[A + i]
    cross(w, R, me, V, out[0], R)
    cross(me, P, out[0], R, out[0], R + 3)
    for c in range(3):
        f = out[1 + c]
        for i in range(3):
            axis[i] = me[3 * i + c]
            for r in range(3):
                f[i] += B[i, r] * me[3 * r + c]
        cross(me, P, f, R, f, R + 3)
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            f[3 + i] += axis[j] * out[0, k] - axis[k] * out[0, j]


@njit(cache=True, error_model="numpy")
def _regress(tree: RigidTree, work: np.ndarray, out: np.ndarray) -> None:
    """Torques of all joints (k, 4 k) by the parameters of the bodies they carry."""
    forces = np.empty((4, 6))
    for b in range(len(tree.parent)):
        _unit_forces(work[b + 1], forces)
        j = b + 1
        while j > 0:
            for c in range(4):
                out[tree.column[j - 1], 4 * b + c] = dot(work[j], S, forces[c], R)
            j = tree.parent[j - 1]


@njit(cache=True, error_model="numpy")
def _relieve(me: np.ndarray, root: np.ndarray) -> None:
    """Take what pushes a body, root[12:18], off the wrench that moves it."""
    push = np.zeros(6)
    turned(me, root[12:15], push, R)
    turned(me, root[15:], push, R + 3)
    cross(me, P, push, R, push, R + 3)
    for c in range(6):
        me[F + c] -= push[c]


@njit(cache=True, error_model="numpy")
def sample(
    tree: RigidTree, q: np.ndarray, v: np.ndarray, a: np.ndarray, root: np.ndarray, work: np.ndarray, out: TreeDynamics
) -> None:  # fmt: skip
    """`dynamics_along` for callers in compiled code; `work` as of `scratch`, `out` is filled."""
    k = len(tree.parent)
    for i in range(len(q)):
        stand(work[0], root[min(i, len(root) - 1)])
        for b in range(k + 1):
            if b > 0:
                me, up, column = work[b], work[tree.parent[b - 1]], tree.column[b - 1]
                place(tree, b - 1, q[i, column], up, me)
                move(me, up, v[i, column], a[i, column])
            weigh(tree, b, work[b])
        if root.shape[1] > 12:
            _relieve(work[k], root[i])
        if out.regressor.shape[2]:
            _regress(tree, work, out.regressor[i])
        for j in range(k - 1, -1, -1):
            _gather(tree, work, j, out, i)
        _borne(work, out, i)


@njit(cache=True, error_model="numpy")
def _gather(tree: RigidTree, work: np.ndarray, j: int, out: TreeDynamics, i: int) -> None:
    """What joint j bears into sample i of `out`, and to the body that carries it."""
    me, root, up, column, b = work[j + 1], work[0], work[tree.parent[j]], tree.column[j], j + 1
    out.torque[i, column] = dot(me, S, me, F)
    times(me, S, me, X)
    root[X:I] = 0.0  # scratch of the root: how what the joint carries weighs as it turns
    cross(me, X, root, A, root, X + 3)
    while b > 0:  # the joints that carry this one
        other = tree.column[b - 1]
        out.inertia[i, other, column] = out.inertia[i, column, other] = dot(work[b], S, me, X)
        out.stiffness[i, other, column] = out.stiffness[i, column, other] = dot(work[b], S, root, X)
        b = tree.parent[b - 1]
    out.coupling[i, column] = me[X : X + 3]
    for c in range(F, ROW):  # the twist between is scratch
        up[c] += me[c]


@njit(cache=True, error_model="numpy")
def _borne(work: np.ndarray, out: TreeDynamics, i: int) -> None:
    """What the root and the first joint bear."""
    first, bears = work[min(1, len(work) - 1)], np.zeros(3)
    cross(first, F, first, P, bears, R)
    for r in range(6):
        out.root[i, r] = work[0, F + r]
        for c in range(6):
            out.composite[i, r, c] = work[0, I + 6 * r + c]
    for c in range(2):
        out.moment[i, c] = 0.0
        for r in range(3):
            out.moment[i, c] += first[3 * r + c] * (bears[r] + first[F + 3 + r])
