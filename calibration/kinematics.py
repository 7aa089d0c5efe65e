"""Forward kinematics of a chain of single joints and its derivatives, for all configurations at once.

    T(q) = F_0 exp6(S_1 q_1) F_1 exp6(S_2 q_2) ... exp6(S_k q_k) F_k

F are constant transforms, S_i the unit twist of joint i in its own frame: [0, a] revolute, [a, 0] prismatic.
Moving a frame P on the way by the local twist x moves the end by the local twist

    G_P x,    G_P = [[A, A x u], [0, A]],    A = R_end' R_P,   u = R_end' (p_end - p_P)        [m, rad]

(column by column). All products are of constants with stacked rows, or element by element; Pinocchio is not called.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from calibration.se3 import compose, skew


@dataclass(frozen=True)
class Placed:
    """Frames along a path for n configurations of k joints: those before each joint, in the frame the path starts from.

    Attributes:
        T: (n, 4, 4) pose of the end.
        R: (n, 3, 3 k) orientations of the frames before each joint, side by side.
        p: (n, 3, k) their origins [m].
    """

    T: np.ndarray
    R: np.ndarray
    p: np.ndarray

    def to_end(self) -> tuple[np.ndarray, np.ndarray]:
        """A and A x u of the start and of the frame before each joint, both (k + 1, n, 3, 3)."""
        n, _, k = self.p.shape
        R_end, p_end = self.T[:, :3, :3], self.T[:, :3, 3:]
        columns = np.concatenate([np.broadcast_to(np.eye(3), (n, 3, 3)), self.R, p_end, p_end - self.p], axis=2)
        turned = np.swapaxes(R_end, 1, 2) @ columns
        A = np.ascontiguousarray(turned[:, :, : 3 * (k + 1)].reshape(n, 3, k + 1, 3).transpose(2, 0, 1, 3))
        u, L = turned[:, :, 3 * (k + 1) :].transpose(2, 0, 1)[..., None], np.empty_like(A)
        for i, j, l in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            L[:, :, i] = A[:, :, j] * u[:, :, l] - A[:, :, l] * u[:, :, j]
        return A, L


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

    @property
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
        frames, origins = np.empty((n, 3, 3 * k)), np.empty((n, 3, k))
        for i in range(k + 1):
            p = p + (R.reshape(-1, 3) @ self.fixed[i, :3, 3]).reshape(n, 3)
            R = (R.reshape(-1, 3) @ self.fixed[i, :3, :3]).reshape(n, 3, 3)
            if i == k:
                break
            frames[:, :, 3 * i : 3 * i + 3], origins[:, :, i] = R, p
            if self.prismatic[i]:
                p = p + (R.reshape(-1, 3) @ self.axis[i]).reshape(n, 3) * q[:, i : i + 1]
            else:
                R = _turned(R, self.axis[i], q[:, i])
        return Placed(compose(R, p), frames, origins)


def _turned(R: np.ndarray, axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """R (n, 3, 3) turned about its own `axis` (3,) by `angle` (n,): R (I + sin [a]x + (1 - cos) [a]x^2)."""
    W = skew(axis)
    rows = R.reshape(-1, 3)
    first, second = (rows @ W).reshape(R.shape), (rows @ (W @ W)).reshape(R.shape)
    return R + np.sin(angle)[:, None, None] * first + (1.0 - np.cos(angle))[:, None, None] * second


def along(A: np.ndarray, L: np.ndarray, M: np.ndarray) -> np.ndarray:
    """G M (n, 6, c) of one frame's A and L (n, 3, 3) and constant local twists M (6, c)."""
    n, c = len(A), M.shape[1]
    J = np.empty((n, 6, c))
    J[:, :3] = (A.reshape(-1, 3) @ M[:3] + L.reshape(-1, 3) @ M[3:]).reshape(n, 3, c)
    J[:, 3:] = (A.reshape(-1, 3) @ M[3:]).reshape(n, 3, c)
    return J


def joints_to_end(A: np.ndarray, L: np.ndarray, twists: np.ndarray) -> np.ndarray:
    """Local twists of the end (n, 6, k) at unit joint velocities, A and L as `Placed.to_end` gives them."""
    v, w = twists[:, None, :3, None], twists[:, None, 3:, None]
    return np.concatenate([(A[1:] @ v + L[1:] @ w)[..., 0], (A[1:] @ w)[..., 0]], axis=2).transpose(1, 2, 0)


def path_of(model: pin.Model, start: int, end: int) -> Path:
    """The path in a model between two frames by their ids; `start` must not move."""
    frame = model.frames[end]
    ids = [i for i in model.supports[frame.parentJoint] if i != 0]
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
        S[i] = pin.computeJointJacobian(model, data, neutral, i)[:, model.joints[i].idx_v]
    return S
