"""Dynamics of a tree of rigid bodies on a moving root, compiled: one sample or all at once, in the root's axes.

    f_i = F_i + sum_children f_c     tau_i = S_i' f_i     M_ij = S_i' I^c_j S_j

i carries j, I^c_j what j carries; f_0 is the wrench on the root, see `rigid_tree`. Leans turn all that the first joint
carries. What pushes the last body from outside is taken off its F. The regressor is how tau changes with masses
and first moments of the bodies, second moments left alone. Reference: Featherstone, Rigid Body Dynamics Algorithms,
2008, ch. 5 and 6.
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
        inertia: (n, k + 2, k + 2) M, symmetric, of the joints and of two leans, about x and y of the first joint's
            frame, of all that it carries [kg.m2, kg.m, kg].
        root: (n, 6) wrench on the root [N, N.m].
        moment: (n, 2) about x and y of the first joint's frame, of the force it passes on [N.m].
        composite: (n, 6, 6) inertia of the whole about the root's origin.
        coupling: (n, k + 2, 6) wrench on the root by unit acceleration of each joint, and of the leans.
        stiffness: (n, k + 2, k + 2) how tau grows with the joints' positions by what bodies weigh, symmetric; 0 of
            leans [N.m, N].
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
        np.empty((n, k)), np.zeros((n, k + 2, k + 2)), np.empty((n, 6)), np.empty((n, 2)), np.empty((n, 6, 6)),
        np.empty((n, k + 2, 6)), np.zeros((n, k + 2, k + 2)), np.zeros((n, k, 4 * k if regressors else 0)),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _unit_forces(w: np.ndarray, b: int, f: int) -> None:
    """Wrenches w[f, :24] about the root's origin by unit mass and first moments of body b, moving: a(r) = a + B r."""
    B, turn, square = 24, V + 3, 0.0
    for c in range(33):
        w[f, c] = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        square += w[b, turn + i] ** 2
        w[f, B + 3 * k + j], w[f, B + 3 * j + k] = w[b, A + 3 + i], -w[b, A + 3 + i]
    for i in range(3):
        w[f, B + 4 * i] -= square
        for c in range(3):
            w[f, B + 3 * i + c] += w[b, turn + i] * w[b, turn + c]
            w[f, i] += w[f, B + 3 * i + c] * w[b, P + c]
        w[f, i] += w[b, A + i]
    cross(w, b, turn, b, V, f, 0)
    cross(w, b, P, f, 0, f, 3)
    for c in range(3):
        by = 6 * (1 + c)
        for i in range(3):
            for r in range(3):
                w[f, by + i] += w[f, B + 3 * i + r] * w[b, 3 * r + c]
        cross(w, b, P, f, by, f, by + 3)
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            w[f, by + 3 + i] += w[b, 3 * j + c] * w[f, k] - w[b, 3 * k + c] * w[f, j]


@njit(cache=True, error_model="numpy")
def _regress(tree: RigidTree, w: np.ndarray, out: np.ndarray, i: int) -> None:
    """Torques of all joints, sample i of out (n, k, 4 k), by the parameters of the bodies they carry."""
    forces = len(tree.parent) + 1
    for b in range(len(tree.parent)):
        _unit_forces(w, b + 1, forces)
        j = b + 1
        while j > 0:
            for c in range(4):
                out[i, tree.column[j - 1], 4 * b + c] = dot(w, j, S, forces, 6 * c)
            j = tree.parent[j - 1]


@njit(cache=True, error_model="numpy")
def _relieve(w: np.ndarray, b: int, root: np.ndarray, i: int) -> None:
    """Take what pushes the last body b, root[i, 12:18], off the wrench that moves it."""
    push = b + 1
    for c in range(6):
        w[push, c], w[push, 6 + c] = root[i, 12 + c], 0.0
    turned(w, b, push, 0, 6)
    turned(w, b, push, 3, 9)
    cross(w, b, P, push, 6, push, 9)
    for c in range(6):
        w[b, F + c] -= w[push, 6 + c]


@njit(cache=True, error_model="numpy")
def sample(
    tree: RigidTree, q: np.ndarray, v: np.ndarray, a: np.ndarray, root: np.ndarray, work: np.ndarray, out: TreeDynamics
) -> None:  # fmt: skip
    """`dynamics_along` for callers in compiled code; `work` as of `scratch`, `out` is filled."""
    k = len(tree.parent)
    for i in range(len(q)):
        stand(root, min(i, len(root) - 1), work)
        weigh(tree, 0, work)
        for j in range(k):
            column = tree.column[j]
            place(tree, j, q[i, column], work)
            move(j + 1, tree.parent[j], v[i, column], a[i, column], work)
            weigh(tree, j + 1, work)
        if root.shape[1] > 12:
            _relieve(work, k, root, i)
        if out.regressor.shape[2]:
            _regress(tree, work, out.regressor, i)
        for j in range(k - 1, -1, -1):
            _gather(tree, work, j, out, i)
        _borne(work, min(1, k), out, i)
        _lean(tree, work, min(1, k), out, i)


@njit(cache=True, error_model="numpy")
def _gather(tree: RigidTree, w: np.ndarray, j: int, out: TreeDynamics, i: int) -> None:
    """What joint j bears into sample i of `out`, and to the body that carries it."""
    me, up, column, b = j + 1, tree.parent[j], tree.column[j], j + 1
    out.torque[i, column] = dot(w, me, S, me, F)
    times(w, me, S, X)
    for c in range(6):
        w[0, X + c] = 0.0  # scratch of the root: how what the joint carries weighs as it turns
    cross(w, me, X, 0, A, 0, X + 3)
    while b > 0:  # the joints that carry this one
        other = tree.column[b - 1]
        out.inertia[i, other, column] = out.inertia[i, column, other] = dot(w, b, S, me, X)
        out.stiffness[i, other, column] = out.stiffness[i, column, other] = dot(w, b, S, 0, X)
        b = tree.parent[b - 1]
    for c in range(6):
        out.coupling[i, column, c] = w[me, X + c]
    for c in range(F, ROW):  # the twist between is scratch
        w[up, c] += w[me, c]


@njit(cache=True, error_model="numpy")
def _borne(w: np.ndarray, first: int, out: TreeDynamics, i: int) -> None:
    """What the root and the first joint bear."""
    for r in range(6):
        out.root[i, r] = w[0, F + r]
        for c in range(6):
            out.composite[i, r, c] = w[0, I + 6 * r + c]
    for c in range(3):
        w[first, X + c] = 0.0
    cross(w, first, F, first, P, first, X)
    for c in range(2):
        out.moment[i, c] = 0.0
        for r in range(3):
            out.moment[i, c] += w[first, 3 * r + c] * (w[first, X + r] + w[first, F + 3 + r])


@njit(cache=True, error_model="numpy")
def _lean(tree: RigidTree, w: np.ndarray, first: int, out: TreeDynamics, i: int) -> None:
    """Inertia and coupling of what the first joint carries as it leans about x and y of that joint's frame."""
    k = out.torque.shape[1]
    for lean in range(k, k + 2):
        for r in range(3):
            w[first, S + r], w[first, S + 3 + r] = 0.0, w[first, 3 * r + lean - k]
        cross(w, first, P, first, S + 3, first, S)
        times(w, first, S, X)
        for r in range(6):
            out.coupling[i, lean, r] = w[first, X + r]
        for j in range(k):
            carried = j + 1
            while carried > first:
                carried = tree.parent[carried - 1]
            if carried == first:
                _share(w, first, out, i, lean, tree.column[j])
        for other in range(k, lean + 1):
            _share(w, first, out, i, lean, other)


@njit(cache=True, error_model="numpy")
def _share(w: np.ndarray, first: int, out: TreeDynamics, i: int, lean: int, other: int) -> None:
    """Inertia of a lean, whose unit twist is that of the first joint's body, and another motion."""
    total = 0.0
    for r in range(6):
        total += w[first, S + r] * out.coupling[i, other, r]
    out.inertia[i, lean, other] = out.inertia[i, other, lean] = total
