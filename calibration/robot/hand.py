"""Pose of the hand body in the base body, as a function of the readings and of all parameters.

    T_B_H(q, theta) = T_base_B^-1  T_base_tool(q - sum_b e_b(q, tau), xi)  T_tool_H

e_b is what parameter block b adds to the readings (`blocks`), tau(q) the nominal gravity torque at the readings: what
the motors must exert at rest [N.m, N]. Parameters are identified by name; derivatives are local twists of the hand.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from calibration.numerics.lie import adjoint, from_vector, inverse
from calibration.robot.blocks import AT_REST, BacklashPreload, Compliance, EncoderZeros, Frames
from calibration.robot.chain import Chain
from calibration.robot.kinematics import Path
from calibration.robot.parameter_block import HandKinematics, ParameterBlock


@dataclass(frozen=True)
class HandPoses:
    """Poses of the hand and their derivatives.

    Attributes:
        T: (n, 4, 4) T_B_H.
        J: (n, 6, p) by the parameters asked for.
        J_joint: (n, 6, k) by joint position.
    """

    T: np.ndarray
    J: np.ndarray
    J_joint: np.ndarray


@dataclass(frozen=True)
class HandModel:
    """A nominal chain with blocks of parameters that have values.

    Attributes:
        nominal: The nominal robot.
        blocks: Marker frames first.
    """

    nominal: Chain
    blocks: tuple[ParameterBlock, ...]

    @cached_property
    def chain(self) -> Chain:
        """The chain with the joint placements of the blocks."""
        chain = self.nominal
        for block in self.blocks:
            chain = block.placed(chain)
        return chain

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters."""
        return tuple(name for block in self.blocks for name in block.names)

    @property
    def theta(self) -> np.ndarray:
        """Values of all parameters, in the order of `names`."""
        return np.concatenate([block.values for block in self.blocks])

    def with_theta(self, theta: np.ndarray, names: Sequence[str] | None = None) -> "HandModel":
        """The model with other values of the named parameters, of all where no name is given."""
        values = dict(zip(self.names if names is None else names, theta, strict=True))
        blocks = []
        for block in self.blocks:
            new = [values.get(name, x) for name, x in zip(block.names, block.values, strict=True)]
            blocks.append(replace(block, values=np.array(new)))
        return replace(self, blocks=tuple(blocks))

    def block(self, kind: type[ParameterBlock]) -> ParameterBlock:
        """The block of a kind."""
        return next(b for b in self.blocks if isinstance(b, kind))

    @property
    def base(self) -> np.ndarray:
        """Translation and rotation vector (6,) of T_base_B [m, rad]."""
        return self.block(Frames).values[:6]

    @property
    def hand(self) -> np.ndarray:
        """Translation and rotation vector (6,) of T_tool_H [m, rad]."""
        return self.block(Frames).values[6:]

    @property
    def offset(self) -> np.ndarray:
        """(k,) zero of each joint's motor-side reading [rad, m]."""
        return self.block(EncoderZeros).values

    @property
    def compliance(self) -> np.ndarray:
        """(k,) of each gear under its gravity torque [rad/(N.m), m/N]."""
        return self.block(Compliance).values

    @property
    def gap(self) -> np.ndarray:
        """(k,) width of each joint's backlash [rad, m]."""
        return self.block(BacklashPreload).values

    def carrying(self, mass: float | None) -> "HandModel":
        """The model with another mass [kg] of its payload; itself where None."""
        return self if mass is None else replace(self, nominal=self.nominal.carrying(mass))

    def angles(self, q: np.ndarray) -> np.ndarray:
        """Joint positions (n, n_measured) behind readings q."""
        if self._constant is not None:
            return np.asarray(q - self._constant)
        out, columns = np.array(q, dtype=float), self._columns
        out[:, columns] -= self._reading_error(q[:, columns], self.nominal.gravity_torques(q))
        return out

    def in_base_frame(self, q: np.ndarray, bend: np.ndarray | None = None) -> np.ndarray:
        """T_base_H (n, 4, 4) at readings q (n, n_measured), in the robot's base frame; `bend` as of `Path.poses`."""
        return self._in_base.poses(self.angles(q)[:, self._columns], bend)

    def poses(self, q: np.ndarray, bend: np.ndarray | None = None) -> np.ndarray:
        """T_B_H (n, 4, 4) at readings q, in the base marker body; `bend` as of `Path.poses`."""
        return self._path.poses(self.angles(q)[:, self._columns], bend)

    def joint_jacobians(self, q: np.ndarray) -> np.ndarray:
        """Derivatives of T_B_H by joint position (n, 6, k), local twists of the hand, at readings q."""
        return adjoint(inverse(from_vector(self.hand))) @ self.chain.joint_jacobians(self.angles(q))

    def poses_and_derivatives(
        self, q: np.ndarray, tau: np.ndarray | None = None, names: Sequence[str] | None = None
    ) -> HandPoses:
        """T_B_H and its derivatives at readings q (n, n_measured).

        Args:
            q: Readings [rad, m].
            tau: (n, k) the chain's gravity torques at q, where they are known already.
            names: Parameters to differentiate by; all where not given.
        """
        names = self.names if names is None else tuple(names)
        asked = set(names)
        blocks = [block for block in self.blocks if not asked.isdisjoint(block.names)]
        at = self.kinematics(q, self._torques(q, blocks) if tau is None else tau)
        found = tuple(name for block in blocks for name in block.names)
        J = np.concatenate([block.jacobian(at) for block in blocks], axis=2) if blocks else np.zeros((len(q), 6, 0))
        if found != names:
            J = J[:, :, [found.index(name) for name in names]]
        return HandPoses(at.T, J, at.J_joint)

    def kinematics(self, q: np.ndarray, tau: np.ndarray) -> HandKinematics:
        """What the blocks' derivatives are made of, at readings q (n, n_measured) and gravity torques tau (n, k)."""
        readings = q[:, self.nominal.columns]
        placed = self._path.placed(readings - self._reading_error(readings, tau))
        twists = np.zeros((len(self.nominal.joints) + 1, 6, 7))
        twists[:, :, :6], twists[1:, :, 6] = np.eye(6), self.nominal.nominal_path.twists
        J = placed.end_twists(twists)
        return HandKinematics(readings, tau, placed.T, J[..., :6], J[:, :, 1:, 6])

    def _torques(self, q: np.ndarray, asked: Sequence[ParameterBlock]) -> np.ndarray:
        """Gravity torques (n, k) at readings q; zero where no block of a loaded gear is asked for or has a value."""
        if any(block.loaded and (block in asked or block.values.any()) for block in self.blocks):
            return self.nominal.gravity_torques(q)
        return np.zeros((len(q), len(self.nominal.joints)))

    def _reading_error(self, q: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """Reading minus angle (n, k) [rad, m] by all blocks."""
        return np.asarray(sum(block.reading_error(q, tau) for block in self.blocks) + np.zeros_like(q))

    @cached_property
    def _columns(self) -> np.ndarray | slice:
        """Of the chain's joints in the readings; a slice, which copies nothing, where they are side by side."""
        found = np.array(self.nominal.columns)
        return slice(found[0], found[-1] + 1) if len(found) and (np.diff(found) == 1).all() else found

    @cached_property
    def _constant(self) -> np.ndarray | None:
        """Reading minus angle (n_measured,) where it depends on neither angle nor torque."""
        if any(block.varies and block.values.any() for block in self.blocks):
            return None
        constant = np.zeros(len(self.nominal.measured))
        constant[self._columns] = self._reading_error(*np.zeros((2, 1, len(self.nominal.columns))))[0]
        return constant

    @cached_property
    def _in_base(self) -> Path:
        """From the base frame to the hand's marker body."""
        fixed = np.array(self.chain.path.fixed)
        fixed[-1] = fixed[-1] @ from_vector(self.hand)
        return replace(self.chain.path, fixed=fixed)

    @cached_property
    def _path(self) -> Path:
        """From the base's marker body to the hand's."""
        fixed = np.array(self._in_base.fixed)
        fixed[0] = inverse(from_vector(self.base)) @ fixed[0]
        return replace(self._in_base, fixed=fixed)


def nominal_hand(chain: Chain, frames: np.ndarray, kinds: Sequence[type[ParameterBlock]] = AT_REST) -> HandModel:
    """The datasheet's robot with marker frames (12,) [m, rad] and blocks of these kinds."""
    return HandModel(chain, tuple(kind.nominal(chain, frames) for kind in kinds))
