"""What the robot's own sensors and the laboratory's targets get wrong: encoders and marker clusters.

Encoder reading of a true angle q [rad]:

    r = round_to_quantum(q + offset + cos1 cos q + sin1 sin q + cos2 cos 2q + sin2 sin 2q)

Cluster placement: T_link_body = exp6(xi), nominally the identity, so that a body's frame is its link's frame.
"""

from dataclasses import dataclass

import numpy as np

from twin.conventions import exp6
from twin.defects.base import Defect, Parameter
from twin.defects.placements import twist_parameters


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


@dataclass(frozen=True)
class Cluster(Defect):
    """A marker cluster on its link.

    Attributes:
        name: Name of the marker body.
        link: The link that carries it.
        frames: The contract's names of both frames, `base.base` or `tool.hand`.
        xi: Placement error of the cluster, twist (6,) [m, rad].
        marker_names: Names of its markers.
        nominal: Nominal marker positions in the body's frame (n, 3) [m].
        shift: Error of each marker within the cluster (n, 3) [m].
    """

    name: str
    link: str
    frames: str
    xi: np.ndarray
    marker_names: tuple[str, ...]
    nominal: np.ndarray
    shift: np.ndarray

    @property
    def T_link_body(self) -> np.ndarray:
        """True pose of the body's frame on its link (4, 4)."""
        return exp6(self.xi)

    def parameters(self) -> tuple[Parameter, ...]:
        """Translation and rotation vector of T_link_body, and each marker's true position in the body's frame."""
        T = self.T_link_body
        values = np.concatenate([T[:3, 3], self.xi[3:]])
        markers = zip(self.marker_names, self.nominal + self.shift, strict=True)
        return (
            *twist_parameters(f"frame.{self.frames}", values),
            *(Parameter(f"marker.{m}.{a}", "m", float(v)) for m, p in markers for a, v in zip("xyz", p, strict=True)),
        )
