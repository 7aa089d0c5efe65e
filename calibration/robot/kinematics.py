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

from calibration.numerics.lie import compose, skew


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
        turned = np.swapaxes(self.T[:, :3, :3], 1, 2) @ columns.reshape(3, n, -1).transpose(1, 0, 2)
        A, L = turned.reshape(3 * n, 2, k + 1, 3).transpose(1, 2, 0, 3)
        linear, angular = twists[:, :3], twists[:, 3:]
        out = np.empty((n, 6, k + 1, c))
        out[:, :3] = (A @ linear + L @ angular).reshape(k + 1, n, 3, c).transpose(1, 2, 0, 3)
        out[:, 3:] = (A @ angular).reshape(k + 1, n, 3, c).transpose(1, 2, 0, 3)
        return out


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
        n, k = q.shape
        R, p = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3))
        frames, origins = np.empty((3, n, k, 3)), np.empty((3, n, k))
        for i in range(k + 1):
            p = p + (R.reshape(-1, 3) @ self.fixed[i, :3, 3]).reshape(n, 3)
            R = (R.reshape(-1, 3) @ self.fixed[i, :3, :3]).reshape(n, 3, 3)
            if i == k:
                break
            frames[:, :, i], origins[:, :, i] = R.transpose(1, 0, 2), p.T
            if self.prismatic[i]:
                p = p + (R.reshape(-1, 3) @ self.axis[i]).reshape(n, 3) * q[:, i : i + 1]
            else:
                R = turned(R, self.axis[i], q[:, i])
        return Placed(compose(R, p), frames, origins)


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
