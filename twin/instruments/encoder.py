"""Joint encoders: offset, eccentricity and quantisation.

r = round_to_quantum(q + offset + cos1 cos q + sin1 sin q + cos2 cos 2q + sin2 sin 2q)      q the true angle [rad]
"""

from dataclasses import dataclass

import numpy as np
from pydantic.dataclasses import dataclass as validated

from twin.defects.defect import Defect
from twin.fields.values import STRICT, NonNegative, Positive
from twin.truth import Parameter


@validated(frozen=True, config=STRICT)
class LinkEncoders:
    """Absolute encoders on the link side, standard deviations of what differs among them.

    Attributes:
        offset: Standard deviation of the zero [rad].
        once: Amplitude of the error once per turn [rad].
        twice: Amplitude of the error twice per turn [rad].
        quantum: Step of the reading [rad].
    """

    offset: NonNegative
    once: NonNegative
    twice: NonNegative
    quantum: Positive


@validated(frozen=True, config=STRICT)
class MotorEncoders:
    """Eccentricity of the motor-side encoders as seen at the joint, standard deviations of what differs among them.

    Attributes:
        once: Amplitude of the error once per turn of the joint [rad].
        twice: Amplitude of the error twice per turn [rad].
    """

    once: NonNegative = 0.0
    twice: NonNegative = 0.0


@dataclass(frozen=True)
class Encoder(Defect):
    """One encoder of one joint.

    Attributes:
        joint_name: The joint.
        side: `motor` or `link`.
        offset: Reading at true zero [rad, or m on a prismatic joint].
        harmonics: cos1, sin1, cos2, sin2 [as the offset], once and twice per turn of the joint.
        quantum: Step of the reading [rad or m].
        prismatic: Whether the joint's position is a length.
    """

    joint_name: str
    side: str
    offset: float
    harmonics: tuple[float, float, float, float]
    quantum: float
    prismatic: bool = False

    def read(self, q: np.ndarray) -> np.ndarray:
        """Readings (n,) of true angles (n,)."""
        c1, s1, c2, s2 = self.harmonics
        wave = c1 * np.cos(q) + s1 * np.sin(q) + c2 * np.cos(2 * q) + s2 * np.sin(2 * q)
        return np.round((q + self.offset + wave) / self.quantum) * self.quantum

    def parameters(self) -> tuple[Parameter, ...]:
        """Offset, harmonics and quantum."""
        names = ("offset", "cos1", "sin1", "cos2", "sin2", "quantum")
        values = (self.offset, *self.harmonics, self.quantum)
        prefix, unit = f"encoder.{self.joint_name}.{self.side}", "m" if self.prismatic else "rad"
        return tuple(Parameter(f"{prefix}.{n}", unit, v) for n, v in zip(names, values, strict=True))


def harmonics(rng: np.random.Generator, once: float, twice: float) -> tuple[float, float, float, float]:
    """cos1, sin1, cos2, sin2 [rad] of standard deviation `once`, `twice` in amplitude."""
    c1, s1, c2, s2 = rng.normal(size=4) * np.repeat([once, twice], 2) / np.sqrt(2.0) + 0.0  # no -0.0
    return float(c1), float(s1), float(c2), float(s2)
