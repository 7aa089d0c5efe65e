"""Forward kinematics of a chain of single joints and its derivatives, for all configurations at once.

    T(q) = F_0 exp6(S_1 q_1) F_1 exp6(S_2 q_2) ... exp6(S_k q_k) F_k

F are constant transforms, S_i the unit twist of joint i in its own frame: [0, a] revolute, [a, 0] prismatic.
Moving a frame P on the way by the local twist x moves the end by the local twist

    G_P x,    G_P = [[A, A x u], [0, A]],    A = R_end' R_P,   u = R_end' (p_end - p_P)        [m, rad]

(column by column); A x u is R_end' (R_P x (p_end - p_P)). All products are of constants with stacked rows, or element
by element; Pinocchio is not called.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from calibration.errors import ShapeError
from calibration.numerics.compiled import njit
from calibration.numerics.lie import skew


@dataclass(frozen=True)
class Placed:
    """Frames along a path for n configurations of k joints: those before each joint, in the frame the path starts from.

    Attributes:
        T: (n, 4, 4) pose of the end.
        R: (3, n, k, 3) orientations of the frames before each joint, rows first.
        p: (3, n, k) their origins [m].
    """

    T: np.ndarray
    R: np.ndarray
    p: np.ndarray

    def end_twists(self, twists: np.ndarray) -> np.ndarray:
        """Local twists of the end (n, 6, k + 1, c) when frames on the way move by constant local `twists`.

        Args:
            twists: (k + 1, 6, c), of the frame the path starts from, then of the frame before each joint [m, rad].
        """
        (_, n, k), c = self.p.shape, twists.shape[2]
        columns, lever = np.empty((3, n, 2, k + 1, 3)), np.empty((3, n, k + 1, 1))
        columns[:, :, 0, 0], columns[:, :, 0, 1:] = np.eye(3)[:, None], self.R
        lever[:, :, 0, 0] = self.T[:, :3, 3].T
        lever[:, :, 1:, 0] = lever[:, :, 0] - self.p
        for i, j, l in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            columns[i, :, 1] = columns[j, :, 0] * lever[l] - columns[l, :, 0] * lever[j]
        turned = np.swapaxes(self.T[:, :3, :3], 1, 2) @ columns.reshape(3, n, 6 * (k + 1)).transpose(1, 0, 2)
        A, L = turned.reshape(3 * n, 2, k + 1, 3).transpose(1, 2, 0, 3)
        linear, angular = twists[:, :3], twists[:, 3:]
        out = np.empty((n, 6, k + 1, c))
        out[:, :3] = (A @ linear + L @ angular).reshape(k + 1, n, 3, c).transpose(1, 2, 0, 3)
        out[:, 3:] = (A @ angular).reshape(k + 1, n, 3, c).transpose(1, 2, 0, 3)
        return out


_STRAIGHT, _UNASKED = np.zeros((0, 3)), (np.zeros((3, 0, 0, 3)), np.zeros((3, 0, 0)))  # of `_walk`


@dataclass(frozen=True)
class Path:
    """A chain of single joints between two frames.

    Attributes:
        fixed: (k + 1, 4, 4) constant transforms before each joint and after the last.
        axis: (k, 3) unit axis of each joint in its own frame.
        prismatic: (k,) whether a joint slides.
    """

    fixed: np.ndarray
    axis: np.ndarray
    prismatic: np.ndarray

    @cached_property
    def twists(self) -> np.ndarray:
        """Unit twist S of each joint, (k, 6)."""
        S = np.zeros((len(self.axis), 6))
        S[self.prismatic, :3], S[~self.prismatic, 3:] = self.axis[self.prismatic], self.axis[~self.prismatic]
        return S

    def moved(self, right: np.ndarray) -> "Path":
        """The path with each constant transform multiplied on the right by `right` (k + 1, 4, 4)."""
        return Path(self.fixed @ right, self.axis, self.prismatic)

    def placed(self, q: np.ndarray) -> Placed:
        """Frames at joint positions q (n, k) [rad, m]."""
        T, (n, k) = self._room(q), q.shape
        R, p = np.empty((3, n, k, 3)), np.empty((3, n, k))
        _walk(self.fixed, self.axis, self.prismatic, np.ascontiguousarray(q, dtype=float), _STRAIGHT, T, (R, p))
        return Placed(T, R, p)

    def poses(self, q: np.ndarray, bend: np.ndarray | None = None) -> np.ndarray:
        """Poses of the end (n, 4, 4) at positions q (n, k) [rad, m].

        `bend` (n, 3): rotation vectors [rad] by which all that the first joint carries is turned, in its frame.
        """
        T, turns = self._room(q), _STRAIGHT if bend is None else np.ascontiguousarray(bend, dtype=float)
        _walk(self.fixed, self.axis, self.prismatic, np.ascontiguousarray(q, dtype=float), turns, T, _UNASKED)
        return T

    def _room(self, q: np.ndarray) -> np.ndarray:
        if q.ndim != 2 or q.shape[1] != len(self.axis):
            raise ShapeError("q", q.shape, ("n", len(self.axis)))
        return np.zeros((len(q), 4, 4))


@njit(cache=True, error_model="numpy")
def _turn(T: np.ndarray, axis: np.ndarray, sine: float, versine: float) -> None:
    """Turn the columns of T's rotation about its own unit axis: R (I + sin [a]x + (1 - cos) [a]x^2)."""
    x, y, z = axis[0], axis[1], axis[2]
    for i in range(3):
        a, b, c = T[i, 0], T[i, 1], T[i, 2]
        along = a * x + b * y + c * z
        T[i, 0] = a + sine * (b * z - c * y) + versine * (along * x - a)
        T[i, 1] = b + sine * (c * x - a * z) + versine * (along * y - b)
        T[i, 2] = c + sine * (a * y - b * x) + versine * (along * z - c)


@njit(cache=True, error_model="numpy")
def shift(T: np.ndarray, fixed: np.ndarray, own: np.ndarray) -> None:
    """Multiply T by `fixed` on the right; `own` (3, 4) is scratch."""
    for i in range(3):
        for c in range(4):
            own[i, c] = T[i, 0] * fixed[0, c] + T[i, 1] * fixed[1, c] + T[i, 2] * fixed[2, c]
    for i in range(3):
        for c in range(3):
            T[i, c] = own[i, c]
        T[i, 3] += own[i, 3]


@njit(cache=True, error_model="numpy")
def _bend(T: np.ndarray, turn: np.ndarray, unit: np.ndarray) -> None:
    """Turn T about its own axes by a rotation vector; `unit` (3,) is scratch."""
    angle = np.sqrt(turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2)
    if angle > 0.0:
        for i in range(3):
            unit[i] = turn[i] / angle
        _turn(T, unit, np.sin(angle), 2.0 * np.sin(0.5 * angle) ** 2)


@njit(cache=True, error_model="numpy")
def _walk(
    fixed: np.ndarray,
    axis: np.ndarray,
    prismatic: np.ndarray,
    q: np.ndarray,
    bend: np.ndarray,
    T: np.ndarray,
    frames: tuple[np.ndarray, np.ndarray],
) -> None:
    """Poses T (n, 4, 4) of a path's end; `frames` R, p of `Placed`, `bend` of `Path.poses`, empty where not wanted."""
    R, p = frames
    own = np.empty((3, 4))
    for n in range(len(q)):
        at = T[n]
        at[0, 0] = at[1, 1] = at[2, 2] = at[3, 3] = 1.0
        for k in range(len(fixed)):
            shift(at, fixed[k], own)
            if k == len(axis):
                break
            if R.shape[1] > 0:
                for i in range(3):
                    p[i, n, k] = at[i, 3]
                    for c in range(3):
                        R[i, n, k, c] = at[i, c]
            if prismatic[k]:
                for i in range(3):
                    along = at[i, 0] * axis[k, 0] + at[i, 1] * axis[k, 1] + at[i, 2] * axis[k, 2]
                    at[i, 3] += along * q[n, k]
            else:
                _turn(at, axis[k], np.sin(q[n, k]), 1.0 - np.cos(q[n, k]))
            if k == 0 and len(bend) > 0:
                _bend(at, bend[n], own[0, :3])


def turned(R: np.ndarray, axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """R (n, 3, 3) turned about its own `axis` (3,) by `angle` (n,): R (I + sin [a]x + (1 - cos) [a]x^2)."""
    W = skew(axis)
    rows = R.reshape(-1, 3)
    first, second = (rows @ W).reshape(R.shape), (rows @ (W @ W)).reshape(R.shape)
    return R + np.sin(angle)[:, None, None] * first + (1.0 - np.cos(angle))[:, None, None] * second


def path_of(model: pin.Model, start: int, end: int) -> Path:
    """The path in a model between two frames by their ids; `end` is carried by all joints that carry `start`."""
    frame = model.frames[end]
    carrying = list(model.supports[model.frames[start].parentJoint])
    ids = [i for i in model.supports[frame.parentJoint] if i not in carrying]
    fixed = [model.jointPlacements[i].homogeneous for i in ids] + [frame.placement.homogeneous]
    fixed[0] = model.frames[start].placement.inverse().homogeneous @ fixed[0]
    S = unit_twists(model)[ids].reshape(-1, 6)
    prismatic = np.abs(S[:, :3]).max(axis=1, initial=0.0) > 0.5
    return Path(np.array(fixed), np.where(prismatic[:, None], S[:, :3], S[:, 3:]), prismatic)


def unit_twists(model: pin.Model) -> np.ndarray:
    """Twist of each joint's own frame at unit joint velocity, (njoints, 6), the universe's zero."""
    data, neutral = model.createData(), pin.neutral(model)
    S = np.zeros((model.njoints, 6))
    for i in range(1, model.njoints):
        J = pin.computeJointJacobian(model, data, neutral, i).reshape(6, model.nv)  # a vector where there is one joint
        S[i] = J[:, model.joints[i].idx_v]
    return S


@njit(cache=True, error_model="numpy")
def beyond(q: np.ndarray, low: np.ndarray, high: np.ndarray) -> bool:
    """Whether any of q (n, k) is outside limits (k,)."""
    for i in range(q.shape[0]):
        for j in range(q.shape[1]):
            if q[i, j] < low[j] or q[i, j] > high[j]:
                return True
    return False
