"""A tree of rigid bodies on a moving root, in the root's axes: where bodies are, how they move and what moves them.

    A_i = A_parent + S_i ddq_i + V_parent x S_i dq_i     F_i = I_i A_i + V_i x* I_i V_i

Twists and wrenches are about the root's origin. A_0 is the root's proper acceleration, gravity taken off. Compiled;
dynamics of a whole tree are in `tree_dynamics`. Reference: Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 5.
"""

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from calibration.numerics.compiled import njit
from calibration.numerics.spatial import cross, turned
from calibration.robot.kinematics import unit_twists

# columns of a body's work: orientation, origin, unit twist, twist, acceleration, wrench, scratch, inertia, their end;
# as numpy's integers, not literals, for each of which numba would compile a function
R, P, S, V, A, F, X, I, ROW = np.array([0, 9, 12, 18, 24, 30, 36, 42, 78])


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


def scratch(tree: RigidTree) -> np.ndarray:
    """Room for one sample of a tree, (k + 1, 78)."""
    return np.zeros((len(tree.mass), ROW))


def last_wrench(tree: RigidTree, q: np.ndarray, v: np.ndarray, a: np.ndarray, root: np.ndarray) -> np.ndarray:
    """F (n, 6) of the last body, about the root's origin in the root's axes, at q, v, a (n, k) on a `root` (n, 12)."""
    (q, v, a), out = np.array([q, v, a], dtype=float), np.empty((len(q), 6))
    _last(tree, q, v, a, np.array(root, dtype=float, order="C"), scratch(tree), out)
    return out


@njit(cache=True, error_model="numpy")
def times(me: np.ndarray, at: int, out: np.ndarray, to: int) -> None:
    """out[to:to + 6] = I me[at:at + 6], I the body's inertia."""
    for i in range(6):
        out[to + i] = 0.0
        for c in range(6):
            out[to + i] += me[I + 6 * i + c] * me[at + c]


@njit(cache=True, error_model="numpy")
def place(tree: RigidTree, j: int, angle: float, up: np.ndarray, me: np.ndarray) -> None:
    """Orientation, origin and unit twist of joint j at an angle, from the body `up` that carries it."""
    fixed, axis, w = tree.fixed[j], tree.axis[j], np.empty(3)
    for i in range(V):
        me[i] = 0.0
    for i in range(3):
        for c in range(3):
            for r in range(3):
                me[3 * i + c] += up[3 * i + r] * fixed[r, c]
            me[P + i] += up[3 * i + c] * fixed[c, 3]
        me[P + i] += up[P + i]
    if tree.prismatic[j]:
        turned(me, axis, me, S)
        for i in range(3):
            me[P + i] += me[S + i] * angle
        return
    turned(me, axis, me, S + 3)
    cross(me, P, me, S + 3, me, S)
    s, c = np.sin(angle), 1.0 - np.cos(angle)
    for i in range(3):
        for r in range(3):
            w[r] = me[3 * i + r]
        for r in range(3):
            across = w[(r + 1) % 3] * axis[(r + 2) % 3] - w[(r + 2) % 3] * axis[(r + 1) % 3]
            me[3 * i + r] += s * across + c * (me[S + 3 + i] * axis[r] - w[r])


@njit(cache=True, error_model="numpy")
def move(me: np.ndarray, up: np.ndarray, v: float, a: float) -> None:
    """Twist and acceleration of a body from those of the one that carries it."""
    for i in range(6):
        me[X + i] = 0.0
    cross(up, V + 3, me, S, me, X)
    cross(up, V, me, S + 3, me, X)
    cross(up, V + 3, me, S + 3, me, X + 3)
    for i in range(6):
        me[V + i] = up[V + i] + me[S + i] * v
        me[A + i] = up[A + i] + me[S + i] * a + me[X + i] * v


@njit(cache=True, error_model="numpy")
def weigh(tree: RigidTree, b: int, me: np.ndarray) -> None:
    """Inertia of body b about the root's origin, and the wrench that moves it."""
    m, inertia, h, square, at = tree.mass[b], tree.inertia[b], np.zeros(3), 0.0, I + 21  # where the angular part is
    me[F:] = 0.0
    turned(me, tree.moment[b], h, R)
    for i in range(3):
        p = me[P + i]
        square += p * (2.0 * h[i] + m * p)
        me[I + 7 * i] = m
        for c in range(3):
            for r in range(3):
                for s in range(3):
                    me[at + 6 * i + c] += me[3 * i + r] * inertia[r, s] * me[3 * c + s]
            me[at + 6 * i + c] -= h[i] * me[P + c] + p * h[c] + m * p * me[P + c]
    for i in range(3):
        me[at + 7 * i] += square
        j, k, first = (i + 1) % 3, (i + 2) % 3, h[i] + m * me[P + i]
        me[at - 3 + 6 * k + j] = me[at - 18 + 6 * j + k] = first
        me[at - 3 + 6 * j + k] = me[at - 18 + 6 * k + j] = -first
    times(me, A, me, F)
    times(me, V, me, X)
    cross(me, V + 3, me, X, me, F)
    cross(me, V + 3, me, X + 3, me, F + 3)
    cross(me, V, me, X, me, F + 3)


@njit(cache=True, error_model="numpy")
def _last(
    tree: RigidTree, q: np.ndarray, v: np.ndarray, a: np.ndarray, root: np.ndarray, work: np.ndarray, out: np.ndarray
) -> None:  # fmt: skip
    """`last_wrench` into `out` (n, 6)."""
    k = len(tree.parent)
    for i in range(len(q)):
        stand(work[0], root[min(i, len(root) - 1)])
        for j in range(k):
            me, up, column = work[j + 1], work[tree.parent[j]], tree.column[j]
            place(tree, j, q[i, column], up, me)
            move(me, up, v[i, column], a[i, column])
        weigh(tree, k, work[k])
        for c in range(6):
            out[i, c] = work[k, F + c]


@njit(cache=True, error_model="numpy")
def stand(me: np.ndarray, root: np.ndarray) -> None:
    """The root itself, its twist and acceleration root[:12]."""
    me[0] = me[4] = me[8] = 1.0
    for c in range(12):
        me[V + c] = root[c]
