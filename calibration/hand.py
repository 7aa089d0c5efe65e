"""Pose of the hand body in the base body, as a function of the readings and of all parameters.

    T_B_H(q, theta) = T_base_B^-1  T_base_tool(q - offset, xi)  T_tool_H

Derivatives are local twists of the hand:

    d/d(T_tool_H)   L(T_tool_H)                        d/d(xi)      Ad(T_H_tool) J_placement
    d/d(T_base_B)   -Ad(T_H_B) L(T_base_B)             d/d(offset)  -Ad(T_H_tool) J_joint

with L = diag(R', Jr(phi)) from (dp, dphi) to the local twist of a frame given as translation and rotation vector.
"""

from dataclasses import dataclass

import numpy as np

from calibration.robot import Chain
from calibration.se3 import adjoint, from_vector, inverse, local_twist


@dataclass(frozen=True)
class HandPoses:
    """Poses of the hand and their derivatives.

    Attributes:
        T: (n, 4, 4) T_B_H.
        J: (n, 6, p) by the parameters, in the order of `HandModel.theta`.
        J_joint: (n, 6, k) by joint position.
    """

    T: np.ndarray
    J: np.ndarray
    J_joint: np.ndarray


@dataclass(frozen=True)
class HandModel:
    """The chain with values for its parameters.

    Attributes:
        chain: Nominal chain with the placement twists of theta applied.
        offset: (k,) zero of each joint's motor-side reading [rad, m].
        base: (6,) translation and rotation vector of T_base_B [m, rad].
        hand: (6,) of T_tool_H [m, rad].
    """

    chain: Chain
    offset: np.ndarray
    base: np.ndarray
    hand: np.ndarray

    def with_theta(self, theta: np.ndarray) -> "HandModel":
        """The model with frames theta[:12] and, where theta goes on, placements (6 k) and offsets (k)."""
        k = len(self.offset)
        if len(theta) == 12:
            return HandModel(self.chain, self.offset, theta[:6], theta[6:12])
        chain = self.chain.with_placements(theta[12 : 12 + 6 * k].reshape(k, 6))
        return HandModel(chain, theta[12 + 6 * k :], theta[:6], theta[6:12])

    @property
    def theta(self) -> np.ndarray:
        """All parameters, (12 + 7 k,)."""
        return np.concatenate([self.base, self.hand, self.chain.xi.ravel(), self.offset])

    def angles(self, q: np.ndarray) -> np.ndarray:
        """Joint positions (n, n_measured) behind readings q."""
        out = np.array(q, dtype=float)
        out[:, self.chain.columns] -= self.offset
        return out

    def in_base_frame(self, q: np.ndarray) -> np.ndarray:
        """T_base_H (n, 4, 4) at readings q (n, n_measured), in the robot's base frame."""
        return self.chain.poses(self.angles(q)) @ from_vector(self.hand)

    def poses(self, q: np.ndarray) -> np.ndarray:
        """T_B_H (n, 4, 4) at readings q, in the base marker body."""
        return inverse(from_vector(self.base)) @ self.in_base_frame(q)

    def joint_jacobians(self, q: np.ndarray) -> np.ndarray:
        """Derivatives of T_B_H by joint position (n, 6, k), local twists of the hand, at readings q."""
        return adjoint(inverse(from_vector(self.hand))) @ self.chain.joint_jacobians(self.angles(q))

    def poses_and_derivatives(self, q: np.ndarray) -> HandPoses:
        """T_B_H and its derivatives at readings q (n, n_measured)."""
        found = self.chain.poses_and_derivatives(self.angles(q))
        T = inverse(from_vector(self.base)) @ found.T @ from_vector(self.hand)
        to_hand = adjoint(inverse(from_vector(self.hand)))
        J_joint = to_hand @ found.J_joint
        J_base = -adjoint(inverse(T)) @ local_twist(self.base)
        J_hand = np.broadcast_to(local_twist(self.hand), (len(T), 6, 6))
        return HandPoses(T, np.concatenate([J_base, J_hand, to_hand @ found.J_placement, -J_joint], axis=2), J_joint)


def nominal_hand(chain: Chain, frames: np.ndarray) -> HandModel:
    """The datasheet's robot with marker frames (12,) [m, rad]."""
    return HandModel(chain, np.zeros(len(chain.joints)), frames[:6], frames[6:])
