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
P, S, V, A, F, X, I, ROW = np.array([9, 12, 18, 24, 30, 36, 42, 78])


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
    """Room for one sample of a tree, (k + 2, 78): a row for each body, and one for what is used in between."""
    return np.zeros((len(tree.mass) + 1, ROW))


def last_wrench(tree: RigidTree, q: np.ndarray, v: np.ndarray, a: np.ndarray, root: np.ndarray) -> np.ndarray:
    """F (n, 6) of the last body, about the root's origin in the root's axes, at q, v, a (n, k) on a `root` (n, 12)."""
    (q, v, a), out = np.array([q, v, a], dtype=float), np.empty((len(q), 6))
    _last(tree, q, v, a, np.array(root, dtype=float, order="C"), scratch(tree), out)
    return out


@njit(cache=True, error_model="numpy")
def times(w: np.ndarray, b: int, at: int, to: int) -> None:
    """w[b, to:to + 6] = I w[b, at:at + 6], I the inertia of body b."""
    for i in range(6):
        total = 0.0
        for c in range(6):
            total += w[b, I + 6 * i + c] * w[b, at + c]
        w[b, to + i] = total


@njit(cache=True, error_model="numpy")
def place(tree: RigidTree, j: int, angle: float, w: np.ndarray) -> None:
    """Orientation, origin and unit twist of joint j at an angle, from the body that carries it."""
    b, up, fixed = j + 1, tree.parent[j], tree.fixed
    for i in range(3):
        w[b, S + i] = w[b, S + 3 + i] = 0.0
        w[b, X + i] = tree.axis[j, i]
        x, y, z = w[up, 3 * i], w[up, 3 * i + 1], w[up, 3 * i + 2]
        for c in range(3):
            w[b, 3 * i + c] = x * fixed[j, 0, c] + y * fixed[j, 1, c] + z * fixed[j, 2, c]
        w[b, P + i] = x * fixed[j, 0, 3] + y * fixed[j, 1, 3] + z * fixed[j, 2, 3] + w[up, P + i]
    if tree.prismatic[j]:
        turned(w, b, b, X, S)
        for i in range(3):
            w[b, P + i] += w[b, S + i] * angle
        return
    turned(w, b, b, X, S + 3)
    cross(w, b, P, b, S + 3, b, S)
    s, c = np.sin(angle), 1.0 - np.cos(angle)
    for i in range(3):
        x, y, z, along = w[b, 3 * i], w[b, 3 * i + 1], w[b, 3 * i + 2], w[b, S + 3 + i]
        w[b, 3 * i] += s * (y * w[b, X + 2] - z * w[b, X + 1]) + c * (along * w[b, X] - x)
        w[b, 3 * i + 1] += s * (z * w[b, X] - x * w[b, X + 2]) + c * (along * w[b, X + 1] - y)
        w[b, 3 * i + 2] += s * (x * w[b, X + 1] - y * w[b, X]) + c * (along * w[b, X + 2] - z)


@njit(cache=True, error_model="numpy")
def move(b: int, up: int, v: float, a: float, w: np.ndarray) -> None:
    """Twist and acceleration of body b from those of the one that carries it, `up`."""
    for i in range(6):
        w[b, X + i] = 0.0
    cross(w, up, V + 3, b, S, b, X)
    cross(w, up, V, b, S + 3, b, X)
    cross(w, up, V + 3, b, S + 3, b, X + 3)
    for i in range(6):
        w[b, V + i] = w[up, V + i] + w[b, S + i] * v
        w[b, A + i] = w[up, A + i] + w[b, S + i] * a + w[b, X + i] * v


@njit(cache=True, error_model="numpy")
def weigh(tree: RigidTree, b: int, w: np.ndarray) -> None:
    """Inertia of body b about the root's origin, and the wrench that moves it."""
    m, square, h, at = tree.mass[b], 0.0, X, I + 21  # where its first moment and the angular part of its inertia are
    for i in range(F, ROW):
        w[b, i] = 0.0
    for i in range(3):
        w[b, h + 3 + i] = tree.moment[b, i]
    turned(w, b, b, h + 3, h)
    for i in range(3):
        p = w[b, P + i]
        square += p * (2.0 * w[b, h + i] + m * p)
        w[b, I + 7 * i] = m
        for c in range(3):
            total = 0.0
            for r in range(3):
                for s in range(3):
                    total += w[b, 3 * i + r] * tree.inertia[b, r, s] * w[b, 3 * c + s]
            w[b, at + 6 * i + c] = total - (w[b, h + i] * w[b, P + c] + p * w[b, h + c] + m * p * w[b, P + c])
    for i in range(3):
        w[b, at + 7 * i] += square
        j, k, first = (i + 1) % 3, (i + 2) % 3, w[b, h + i] + m * w[b, P + i]
        w[b, at - 3 + 6 * k + j] = w[b, at - 18 + 6 * j + k] = first
        w[b, at - 3 + 6 * j + k] = w[b, at - 18 + 6 * k + j] = -first
    times(w, b, A, F)
    times(w, b, V, X)
    cross(w, b, V + 3, b, X, b, F)
    cross(w, b, V + 3, b, X + 3, b, F + 3)
    cross(w, b, V, b, X, b, F + 3)


@njit(cache=True, error_model="numpy")
def _last(
    tree: RigidTree, q: np.ndarray, v: np.ndarray, a: np.ndarray, root: np.ndarray, work: np.ndarray, out: np.ndarray
) -> None:  # fmt: skip
    """`last_wrench` into `out` (n, 6)."""
    k = len(tree.parent)
    for i in range(len(q)):
        stand(root, min(i, len(root) - 1), work)
        for j in range(k):
            column = tree.column[j]
            place(tree, j, q[i, column], work)
            move(j + 1, tree.parent[j], v[i, column], a[i, column], work)
        weigh(tree, k, work)
        for c in range(6):
            out[i, c] = work[k, F + c]


@njit(cache=True, error_model="numpy")
def stand(root: np.ndarray, i: int, w: np.ndarray) -> None:
    """The root itself, its twist and acceleration root[i, :12]."""
    w[0, 0] = w[0, 4] = w[0, 8] = 1.0
    for c in range(12):
        w[0, V + c] = root[i, c]
