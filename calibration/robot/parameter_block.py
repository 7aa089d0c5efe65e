"""What a group of parameters does to the pose of the hand; one class, one file, for each physical effect.

    T_B_H(q, theta) = path(q - sum_b e_b(q, tau))        e_b what block b adds to the readings [rad, m]

A block either changes the path (frames, placements) or the readings (zeros, compliance, backlash). It states its
parameters with units and priors; names identify them everywhere, nothing depends on their position.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from calibration.inference.parameters import ParameterSet
from calibration.recording.schema import Tolerances
from calibration.robot.chain import Chain
from calibration.robot.nominal_frames import METRES_PER_RAD


@dataclass(frozen=True)
class HandKinematics:
    """The hand at n readings of a chain of k joints.

    Attributes:
        q: (n, k) readings of the chain's joints [rad, m].
        tau: (n, k) their gravity torques [N.m, N].
        T: (n, 4, 4) T_B_H.
        J_frame: (n, 6, k + 1, 6) local twist of the hand by local twists of the frame the path starts from, then of the
            frame before each joint.
        J_joint: (n, 6, k) by joint position.
    """

    q: np.ndarray
    tau: np.ndarray
    T: np.ndarray
    J_frame: np.ndarray
    J_joint: np.ndarray


@dataclass(frozen=True)
class Known:
    """What priors are made of.

    Attributes:
        chain: The nominal robot.
        tolerances: Of the datasheet.
        frames: (12,) standard deviations of both marker frames [m, rad].
        tau: (n, k) gravity torques of the postures [N.m, N]; (0, k) where no loaded gear is estimated.
        deflection: Of a gear at its own largest gravity torque, preloaded backlash included [rad].
        measured: Names of parameters whose nominal values were measured on this robot.
    """

    chain: Chain
    tolerances: Tolerances
    frames: np.ndarray
    tau: np.ndarray
    deflection: float = 3e-2
    measured: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class ParameterBlock:
    """Parameters of one physical effect with their values; subclasses state names, units, prior and effect.

    Attributes:
        joints: Joints of the chain, base to tip.
        lengths: (k,) what a radian is worth: 1 rad, or a tenth of it in metres where a joint slides.
        values: (p,).
    """

    joints: tuple[str, ...]
    lengths: np.ndarray
    values: np.ndarray

    loaded: ClassVar[bool] = False  # whether the effect depends on gravity torques
    varies: ClassVar[bool] = True  # whether the reading error, where there is one, depends on angle or torque
    averaged: ClassVar[bool] = False  # whether the fit is averaged over which of them are zero

    @classmethod
    def nominal(cls, chain: Chain, frames: np.ndarray) -> Self:
        """At zero; `frames` (12,) are the nominal marker frames."""
        lengths = joint_lengths(chain)
        none = cls(chain.joints, lengths, np.zeros(0))
        return replace(none, values=np.zeros(len(none.names)))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters as in the contract, length p."""
        raise NotImplementedError

    @property
    def units(self) -> tuple[str, ...]:
        """Their units, length p."""
        raise NotImplementedError

    @property
    def groups(self) -> tuple[str, ...]:
        """Labels of those whose tolerances share a factor the data decide, see `ParameterSet`."""
        return (type(self).__name__,) * len(self.names)

    def tolerance(self, known: Known) -> np.ndarray:
        """Standard deviations (p,) of the priors."""
        raise NotImplementedError

    def placed(self, chain: Chain) -> Chain:
        """The chain as the values change it."""
        return chain

    def reading_error(self, q: np.ndarray, tau: np.ndarray) -> np.ndarray | float:
        """What the effect adds to readings q (n, k) under gravity torques tau (n, k), (n, k) [rad, m]."""
        return 0.0

    def jacobian(self, at: HandKinematics) -> np.ndarray:
        """Local twist of the hand by the parameters (n, 6, p)."""
        raise NotImplementedError

    def parameters(self, known: Known) -> ParameterSet:
        """Names, units, nominal values and priors."""
        measured = tuple(name for name in self.names if name in known.measured)
        return ParameterSet(self.names, self.units, self.values, self.tolerance(known), self.groups, measured)


class ReadingError(ParameterBlock):
    """One parameter a joint, linear in its reading: e_j = theta_j f_j(q, tau).

    Subclasses state the names' pattern, the units of joints that turn and that slide, and f.
    """

    pattern: ClassVar[str]
    unit: ClassVar[tuple[str, str]] = ("rad", "m")

    @property
    def names(self) -> tuple[str, ...]:
        """One a joint."""
        return tuple(self.pattern.format(joint) for joint in self.joints)

    @property
    def units(self) -> tuple[str, ...]:
        """By whether a joint turns or slides."""
        return tuple(self.unit[int(length != 1.0)] for length in self.lengths)

    def shape(self, q: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """f (n, k)."""
        raise NotImplementedError

    def reading_error(self, q: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """theta f."""
        return self.values * self.shape(q, tau)

    def jacobian(self, at: HandKinematics) -> np.ndarray:
        """A reading too large is an angle too small."""
        return -self.shape(at.q, at.tau)[:, None, :] * at.J_joint


def joint_lengths(chain: Chain) -> np.ndarray:
    """(k,) what a radian is worth for each joint: 1 rad, or a tenth of it in metres where it slides."""
    return np.array([METRES_PER_RAD if chain.is_prismatic(name) else 1.0 for name in chain.joints])


def parameters_of(blocks: Sequence[ParameterBlock], known: Known) -> ParameterSet:
    """Of several blocks, one after the other."""
    first, *rest = (block.parameters(known) for block in blocks)
    for more in rest:
        first = first.joined(more)
    return first
