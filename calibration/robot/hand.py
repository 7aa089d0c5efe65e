"""Pose of the hand body in the base body, as a function of the readings and of all parameters.

    T_B_H(q, theta) = T_base_B^-1  T_base_tool(q - offset - compliance tau - gap/2 tanh(tau / tau_0), xi)  T_tool_H

tau(q) is the nominal gravity torque at the readings: what the motors must exert at rest, [N.m, N]. Compliance is
linear in it; backlash of width `gap` is preloaded by gravity to one side, smoothed by tanh where gravity is weak.
Derivatives are local twists of the hand:

    d/d(T_tool_H)   L(T_tool_H)                        d/d(xi)      Ad(T_H_tool) J_placement
    d/d(T_base_B)   -Ad(T_H_B) L(T_base_B)             d/d(offset)  -Ad(T_H_tool) J_joint

by compliance as by offset times tau, by gap as by offset times tanh(tau / tau_0) / 2,
with L = diag(R', Jr(phi)) from (dp, dphi) to the local twist of a frame given as translation and rotation vector.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from calibration.numerics.lie import adjoint, from_vector, inverse, local_twist
from calibration.robot.chain import Chain
from calibration.robot.kinematics import Path

_PRELOADS = 0.3  # tau_0 [N.m, N]


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
        compliance: (k,) of each gear under its gravity torque [rad/(N.m), m/N].
        gap: (k,) width of each joint's backlash [rad, m].
    """

    chain: Chain
    offset: np.ndarray
    base: np.ndarray
    hand: np.ndarray
    compliance: np.ndarray
    gap: np.ndarray

    def with_theta(self, theta: np.ndarray) -> "HandModel":
        """The model with the first of theta changed: 12 frames, 12 + 7 k with placements and offsets, and so on."""
        k, theta = len(self.offset), np.append(theta, self.theta[len(theta) :])
        chain = self.chain.with_placements(theta[12 : 12 + 6 * k].reshape(k, 6))
        offset, compliance, gap = theta[12 + 6 * k :].reshape(3, k)
        return HandModel(chain, offset, theta[:6], theta[6:12], compliance, gap)

    @property
    def theta(self) -> np.ndarray:
        """All parameters, (12 + 9 k,)."""
        return np.concatenate([self.base, self.hand, self.chain.xi.ravel(), self.offset, self.compliance, self.gap])

    def carrying(self, mass: float | None) -> "HandModel":
        """The model with another mass [kg] of its payload; itself where None."""
        return self if mass is None else replace(self, chain=self.chain.carrying(mass))

    def angles(self, q: np.ndarray) -> np.ndarray:
        """Joint positions (n, n_measured) behind readings q."""
        out = np.array(q, dtype=float)
        out[:, self.chain.columns] -= self.offset
        if self.compliance.any() or self.gap.any():
            out[:, self.chain.columns] -= self._deflection(self.chain.gravity_torques(q))
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

    def poses_and_derivatives(
        self, q: np.ndarray, tau: np.ndarray | None = None, n_parameters: int | None = None
    ) -> HandPoses:
        """T_B_H and its derivatives at readings q (n, n_measured).

        Args:
            q: Readings [rad, m].
            tau: (n, k) the chain's gravity torques at q, where they are known already.
            n_parameters: How many of theta to differentiate by; all where not given.
        """
        k = len(self.offset)
        p = 12 + 9 * k if n_parameters is None else n_parameters
        if tau is None:
            yields = self.compliance.any() or self.gap.any() or p > 12 + 7 * k
            tau = self.chain.gravity_torques(q) if yields else np.zeros((len(q), k))
        placed = self._path.placed(q[:, self.chain.columns] - self.offset - self._deflection(tau))
        twists = self.chain.twists.copy()
        twists[0, :, :6] = -local_twist(self.base)
        found, J = placed.end_twists(twists), np.empty((len(q), 6, p))
        J_joint = found[:, :, 1:, 6]
        J[:, :, :6], J[:, :, 6:12] = found[:, :, 0, :6], local_twist(self.hand)
        if p > 12:
            J[:, :, 12 : 12 + 6 * k] = found[:, :, 1:, :6].reshape(len(q), 6, 6 * k)
            J[:, :, 12 + 6 * k : 12 + 7 * k] = -J_joint
        if p > 12 + 7 * k:
            J[:, :, 12 + 7 * k : 12 + 8 * k] = -tau[:, None, :] * J_joint
        if p > 12 + 8 * k:
            J[:, :, 12 + 8 * k :] = -preload_side(tau)[:, None, :] * J_joint
        return HandPoses(placed.T, J, J_joint)

    def _deflection(self, tau: np.ndarray) -> np.ndarray:
        """Reading minus angle (n, k) [rad, m] by compliance and backlash under gravity torques tau (n, k)."""
        return self.compliance * tau + self.gap * preload_side(tau)

    @cached_property
    def _path(self) -> Path:
        """From the base's marker body to the hand's."""
        fixed = np.array(self.chain.path.fixed)
        fixed[0], fixed[-1] = inverse(from_vector(self.base)) @ fixed[0], fixed[-1] @ from_vector(self.hand)
        return replace(self.chain.path, fixed=fixed)


def nominal_hand(chain: Chain, frames: np.ndarray) -> HandModel:
    """The datasheet's robot with marker frames (12,) [m, rad]."""
    k = len(chain.joints)
    return HandModel(chain, np.zeros(k), frames[:6], frames[6:], np.zeros(k), np.zeros(k))


def preload_side(tau: np.ndarray) -> np.ndarray:
    """tanh(tau / tau_0) / 2: where in its backlash gravity torques tau [N.m, N] preload a gear, -1/2 to 1/2 [-]."""
    return np.asarray(0.5 * np.tanh(tau / _PRELOADS))
