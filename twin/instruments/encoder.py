"""What the robot's own sensors and the laboratory's targets get wrong: encoders and marker clusters.

Encoder reading of a true angle q [rad]:

    r = round_to_quantum(q + offset + cos1 cos q + sin1 sin q + cos2 cos 2q + sin2 sin 2q)

Cluster placement: T_link_body = exp6(xi), nominally the identity, so that a body's frame is its link's frame.
"""

from dataclasses import dataclass

import numpy as np

from twin.defects.defect import Defect
from twin.truth import Parameter


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
