"""Dynamics of a tree of rigid bodies on a moving root, compiled: one sample or all at once, in the root's axes.

    A_i = A_parent + S_i ddq_i + V_parent x S_i dq_i     f_i = I_i A_i + V_i x* I_i V_i + sum_children f_c
    tau_i = S_i' f_i,   M_ij = S_i' I^c_j S_j            i carries j, I^c_j what j carries; f_0 the wrench on the root

Twists and wrenches are about the root's origin. A_0 is the root's proper acceleration, gravity taken off. What pushes
the last body from outside is taken off its f. The regressor is how tau changes with masses and first moments of the
bodies, second moments left alone. Reference: Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 5 and 6.
"""

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from calibration.numerics.compiled import njit
from calibration.numerics.spatial import cross, dot, turned
from calibration.robot.kinematics import unit_twists


class RigidTree(NamedTuple):
    """A root (body 0) and k joints with the bodies they carry, parents before children.

    Attributes:
        column: (k,) column of each joint in every q.
        parent: (k,) body that carries each joint.
        fixed: (k, 3, 4) rotation and origin of each joint's frame in that body's.
        axis: (k, 3) unit axis in the joint's frame.
        prismatic: (k,) whether a joint slides.
        mass: (k + 1,) [kg].
        moment: (k + 1, 3) first moments in the body's frame [kg.m].
        inertia: (k + 1, 3, 3) about the body's origin [kg.m2].
    """

    column: np.ndarray
    parent: np.ndarray
    fixed: np.ndarray
    axis: np.ndarray
    prismatic: np.ndarray
    mass: np.ndarray
    moment: np.ndarray
    inertia: np.ndarray


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


def tree_of(model: pin.Model, joints: tuple[str, ...]) -> RigidTree:
    """The tree of a floating model, whose readings have the columns `joints`."""
    ids, S, bodies = range(2, model.njoints), unit_twists(model)[2:], list(model.inertias)[1:]
    prismatic = np.abs(S[:, :3]).max(axis=1, initial=0.0) > 0.5
    return RigidTree(
        np.array([joints.index(model.names[i]) for i in ids], dtype=np.int64),
        np.array([model.parents[i] - 1 for i in ids], dtype=np.int64),
        np.array([model.jointPlacements[i].homogeneous[:3] for i in ids]).reshape(-1, 3, 4),
        np.where(prismatic[:, None], S[:, :3], S[:, 3:]),
        prismatic,
        np.array([body.mass for body in bodies]),
        np.array([body.mass * body.lever for body in bodies]),
        np.array([body.matrix()[3:, 3:] for body in bodies]),
    )


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


# columns of `work`; as numpy's integers, not literals, for each of which numba would compile a function
_R, _P, _S, _V, _A, _F, _X, _I, _ROW = np.array([0, 9, 12, 18, 24, 30, 36, 42, 78])


def room(n: int, k: int, regressors: bool = False) -> TreeDynamics:
    """What dynamics of n samples of k joints are written to."""
    return TreeDynamics(
        np.empty((n, k)), np.zeros((n, k, k)), np.empty((n, 6)), np.empty((n, 2)), np.empty((n, 6, 6)),
        np.empty((n, k, 3)), np.zeros((n, k, k)), np.zeros((n, k, 4 * k if regressors else 0)),
    )  # fmt: skip


def scratch(tree: RigidTree) -> np.ndarray:
    """Room for one sample of a tree, (k + 1, 78)."""
    return np.zeros((len(tree.mass), _ROW))


@njit(cache=True, error_model="numpy")
def _times(me: np.ndarray, at: int, out: np.ndarray, to: int) -> None:
    """out[to:to + 6] = I me[at:at + 6], I the body's inertia."""
    for i in range(6):
        out[to + i] = 0.0
        for c in range(6):
            out[to + i] += me[_I + 6 * i + c] * me[at + c]


@njit(cache=True, error_model="numpy")
def _place(tree: RigidTree, j: int, angle: float, up: np.ndarray, me: np.ndarray) -> None:
    """Orientation, origin and unit twist of joint j at an angle, from the body `up` that carries it."""
    fixed, axis, w = tree.fixed[j], tree.axis[j], np.empty(3)
    for i in range(_V):
        me[i] = 0.0
    for i in range(3):
        for c in range(3):
            for r in range(3):
                me[3 * i + c] += up[3 * i + r] * fixed[r, c]
            me[_P + i] += up[3 * i + c] * fixed[c, 3]
        me[_P + i] += up[_P + i]
    if tree.prismatic[j]:
        turned(me, axis, me, _S)
        for i in range(3):
            me[_P + i] += me[_S + i] * angle
        return
    turned(me, axis, me, _S + 3)
    cross(me, _P, me, _S + 3, me, _S)
    s, c = np.sin(angle), 1.0 - np.cos(angle)
    for i in range(3):
        for r in range(3):
            w[r] = me[3 * i + r]
        for r in range(3):
            across = w[(r + 1) % 3] * axis[(r + 2) % 3] - w[(r + 2) % 3] * axis[(r + 1) % 3]
            me[3 * i + r] += s * across + c * (me[_S + 3 + i] * axis[r] - w[r])


@njit(cache=True, error_model="numpy")
def _move(me: np.ndarray, up: np.ndarray, v: float, a: float) -> None:
    """Twist and acceleration of a body from those of the one that carries it."""
    for i in range(6):
        me[_X + i] = 0.0
    cross(up, _V + 3, me, _S, me, _X)
    cross(up, _V, me, _S + 3, me, _X)
    cross(up, _V + 3, me, _S + 3, me, _X + 3)
    for i in range(6):
        me[_V + i] = up[_V + i] + me[_S + i] * v
        me[_A + i] = up[_A + i] + me[_S + i] * a + me[_X + i] * v


@njit(cache=True, error_model="numpy")
def _weigh(tree: RigidTree, b: int, me: np.ndarray) -> None:
    """Inertia of body b about the root's origin, and the wrench that moves it."""
    m, inertia, h, square, at = tree.mass[b], tree.inertia[b], np.zeros(3), 0.0, _I + 21  # where the angular part is
    turned(me, tree.moment[b], h, _R)
    me[_I:] = 0.0
    for i in range(3):
        p = me[_P + i]
        square += p * (2.0 * h[i] + m * p)
        me[_I + 7 * i] = m
        for c in range(3):
            for r in range(3):
                for s in range(3):
                    me[at + 6 * i + c] += me[3 * i + r] * inertia[r, s] * me[3 * c + s]
            me[at + 6 * i + c] -= h[i] * me[_P + c] + p * h[c] + m * p * me[_P + c]
    for i in range(3):
        me[at + 7 * i] += square
        j, k, first = (i + 1) % 3, (i + 2) % 3, h[i] + m * me[_P + i]
        me[at - 3 + 6 * k + j] = me[at - 18 + 6 * j + k] = first
        me[at - 3 + 6 * j + k] = me[at - 18 + 6 * k + j] = -first
    _times(me, _A, me, _F)
    _times(me, _V, me, _X)
    cross(me, _V + 3, me, _X, me, _F)
    cross(me, _V + 3, me, _X + 3, me, _F + 3)
    cross(me, _V, me, _X, me, _F + 3)


@njit(cache=True, error_model="numpy")
def _unit_forces(me: np.ndarray, out: np.ndarray) -> None:
    """Wrenches (4, 6) about the root's origin by unit mass and first moments of a body that moves: a(r) = a + B r."""
    B, axis, w, square = np.zeros((3, 3)), np.empty(3), np.empty(3), 0.0
    out[:] = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        w[i] = me[_V + 3 + i]
        square += w[i] ** 2
        B[k, j], B[j, k] = me[_A + 3 + i], -me[_A + 3 + i]
    for i in range(3):
        B[i, i] -= square
        for c in range(3):
            B[i, c] += w[i] * w[c]
            out[0, i] += B[i, c] * me[_P + c]
        out[0, i] += me[_A + i]
    cross(w, _R, me, _V, out[0], _R)
    cross(me, _P, out[0], _R, out[0], _R + 3)
    for c in range(3):
        f = out[1 + c]
        for i in range(3):
            axis[i] = me[3 * i + c]
            for r in range(3):
                f[i] += B[i, r] * me[3 * r + c]
        cross(me, _P, f, _R, f, _R + 3)
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
                out[tree.column[j - 1], 4 * b + c] = dot(work[j], _S, forces[c], _R)
            j = tree.parent[j - 1]


@njit(cache=True, error_model="numpy")
def _relieve(me: np.ndarray, root: np.ndarray) -> None:
    """Take what pushes a body, root[12:18], off the wrench that moves it."""
    push = np.zeros(6)
    turned(me, root[12:15], push, _R)
    turned(me, root[15:], push, _R + 3)
    cross(me, _P, push, _R, push, _R + 3)
    for c in range(6):
        me[_F + c] -= push[c]


@njit(cache=True, error_model="numpy")
def sample(
    tree: RigidTree, q: np.ndarray, v: np.ndarray, a: np.ndarray, root: np.ndarray, work: np.ndarray, out: TreeDynamics
) -> None:  # fmt: skip
    """`dynamics_along` for callers in compiled code; `work` as of `scratch`, `out` is filled."""
    k = len(tree.parent)
    work[0, 0] = work[0, 4] = work[0, 8] = 1.0
    for i in range(len(q)):
        work[0, _V:_F] = root[min(i, len(root) - 1), :12]
        for b in range(k + 1):
            if b > 0:
                me, up, column = work[b], work[tree.parent[b - 1]], tree.column[b - 1]
                _place(tree, b - 1, q[i, column], up, me)
                _move(me, up, v[i, column], a[i, column])
            _weigh(tree, b, work[b])
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
    out.torque[i, column] = dot(me, _S, me, _F)
    _times(me, _S, me, _X)
    root[_X:_I] = 0.0  # scratch of the root: how what the joint carries weighs as it turns
    cross(me, _X, root, _A, root, _X + 3)
    while b > 0:  # the joints that carry this one
        other = tree.column[b - 1]
        out.inertia[i, other, column] = out.inertia[i, column, other] = dot(work[b], _S, me, _X)
        out.stiffness[i, other, column] = out.stiffness[i, column, other] = dot(work[b], _S, root, _X)
        b = tree.parent[b - 1]
    out.coupling[i, column] = me[_X : _X + 3]
    for c in range(_F, _ROW):  # the twist between is scratch
        up[c] += me[c]


@njit(cache=True, error_model="numpy")
def _borne(work: np.ndarray, out: TreeDynamics, i: int) -> None:
    """What the root and the first joint bear."""
    first, bears = work[min(1, len(work) - 1)], np.zeros(3)
    cross(first, _F, first, _P, bears, _R)
    for r in range(6):
        out.root[i, r] = work[0, _F + r]
        for c in range(6):
            out.composite[i, r, c] = work[0, _I + 6 * r + c]
    for c in range(2):
        out.moment[i, c] = 0.0
        for r in range(3):
            out.moment[i, c] += first[3 * r + c] * (bears[r] + first[_F + 3 + r])
