"""Parameters of the arm's geometry and of its gears at rest, in one fixed order.

    frame.<a>.<b>                 translation [m] and rotation vector [rad] of T_a_b
    geometry.<joint>              exp6 twist on the right of the joint placement [m, rad]
    encoder.<joint>.motor.offset  reading = angle + offset [rad, m]
    gear.<joint>.compliance       reading = angle + ... + compliance * gravity torque [rad/(N.m), m/N]
    backlash.<joint>.gap          reading = angle + ... + gap / 2 * tanh(gravity torque / tau_0) [rad, m]

A joint's offset and the twist along its axis move the hand alike: the data identify their combination, their
tolerances divide it. Derivatives are local twists of the hand:

    d/d(T_tool_H)   L(T_tool_H)                        d/d(xi)      J_frame Jexp6(xi)
    d/d(T_base_B)   -J_frame L(T_base_B)               d/d(offset)  -J_joint

with L = diag(R', Jr(phi)) from (dp, dphi) to the local twist of a frame given as translation and rotation vector.
"""

from dataclasses import replace
from typing import ClassVar, Self

import numpy as np

from calibration.numerics.lie import jexp6, local_twist
from calibration.robot.chain import Chain
from calibration.robot.nominal_frames import AXES, frame_names
from calibration.robot.parameter_block import HandKinematics, Known, ParameterBlock, ReadingError

_POSE = ("m", "m", "m", "rad", "rad", "rad")
_PRELOADS = 0.3  # tau_0 [N.m, N]
_TORQUE = 0.5  # [N.m, N] a joint that gravity loads less has no own range of torque


class Frames(ParameterBlock):
    """T_base_B and T_tool_H: where the two marker bodies are."""

    varies: ClassVar[bool] = False

    @classmethod
    def nominal(cls, chain: Chain, frames: np.ndarray) -> Self:
        """At the nominal frames (12,)."""
        return replace(super().nominal(chain, frames), values=frames)

    @property
    def names(self) -> tuple[str, ...]:
        """Base first."""
        return tuple(f"{prefix}.{axis}" for prefix in frame_names() for axis in AXES)

    @property
    def units(self) -> tuple[str, ...]:
        """Of both."""
        return _POSE * 2

    @property
    def groups(self) -> tuple[str, ...]:
        """Fixed tolerances."""
        return ("",) * 12

    @property
    def base(self) -> np.ndarray:
        """Translation and rotation vector (6,) of T_base_B [m, rad]."""
        return self.values[:6]

    @property
    def hand(self) -> np.ndarray:
        """Translation and rotation vector (6,) of T_tool_H [m, rad]."""
        return self.values[6:]

    def tolerance(self, known: Known) -> np.ndarray:
        """Of marker bodies on their links."""
        return known.frames

    def jacobian(self, at: HandKinematics) -> np.ndarray:
        """By both frames."""
        by_base = -at.J_frame[:, :, 0] @ local_twist(self.base)
        return np.concatenate([by_base, np.broadcast_to(local_twist(self.hand), by_base.shape)], axis=2)


class Placements(ParameterBlock):
    """Twist xi of each joint placement, on the right: M <- M exp6(xi)."""

    varies: ClassVar[bool] = False

    @classmethod
    def nominal(cls, chain: Chain, frames: np.ndarray) -> Self:
        """Those of the chain."""
        return replace(super().nominal(chain, frames), values=chain.xi.ravel())

    @property
    def names(self) -> tuple[str, ...]:
        """Joint by joint."""
        return tuple(f"geometry.{joint}.{axis}" for joint in self.joints for axis in AXES)

    @property
    def units(self) -> tuple[str, ...]:
        """Linear, then angular."""
        return _POSE * len(self.joints)

    @property
    def groups(self) -> tuple[str, ...]:
        """Translations of all joints share a factor, rotations another."""
        return (*("placement translation",) * 3, *("placement rotation",) * 3) * len(self.joints)

    @property
    def xi(self) -> np.ndarray:
        """(k, 6) [m, rad]."""
        return self.values.reshape(-1, 6)

    def tolerance(self, known: Known) -> np.ndarray:
        """Of every joint alike."""
        each = np.repeat([known.tolerances.joint_translation, known.tolerances.joint_rotation], 3)
        return np.tile(each, len(self.joints))

    def placed(self, chain: Chain) -> Chain:
        """The chain with these placements."""
        return chain.with_placements(self.xi)

    def jacobian(self, at: HandKinematics) -> np.ndarray:
        """By each joint's frame."""
        moved = at.J_frame[:, :, 1:].transpose(2, 0, 1, 3) @ jexp6(self.xi)[:, None]
        return moved.transpose(1, 2, 0, 3).reshape(len(at.T), 6, 6 * len(self.joints))


class EncoderZeros(ReadingError):
    """Zero of each motor-side reading."""

    pattern: ClassVar[str] = "encoder.{}.motor.offset"
    varies: ClassVar[bool] = False

    def tolerance(self, known: Known) -> np.ndarray:
        """Of the encoders."""
        return known.tolerances.encoder_offset * self.lengths

    def shape(self, q: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """1."""
        return np.ones_like(q)


class Compliance(ReadingError):
    """Compliance of each gear under gravity torque."""

    pattern: ClassVar[str] = "gear.{}.compliance"
    unit: ClassVar[tuple[str, str]] = ("rad/(N.m)", "m/N")
    loaded: ClassVar[bool] = True
    averaged: ClassVar[bool] = True

    def tolerance(self, known: Known) -> np.ndarray:
        """What turns each joint by `deflection` at the largest of its torques."""
        return known.deflection * self.lengths / np.maximum(np.abs(known.tau).max(axis=0), _TORQUE)

    def shape(self, q: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """The torque."""
        return tau


class BacklashPreload(ReadingError):
    """Backlash of each gear that gravity preloads to one side."""

    pattern: ClassVar[str] = "backlash.{}.gap"
    loaded: ClassVar[bool] = True
    averaged: ClassVar[bool] = True

    def tolerance(self, known: Known) -> np.ndarray:
        """Half of it as wide as the datasheet's backlash."""
        return 2.0 * known.tolerances.joint_play * self.lengths

    def shape(self, q: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """tanh(tau / tau_0) / 2: to which side, smoothed where gravity is weak."""
        return np.asarray(0.5 * np.tanh(tau / _PRELOADS))


GEOMETRY: tuple[type[ParameterBlock], ...] = (Frames, Placements, EncoderZeros)
AT_REST: tuple[type[ParameterBlock], ...] = (*GEOMETRY, Compliance, BacklashPreload)
