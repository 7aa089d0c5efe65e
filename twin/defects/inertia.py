"""Masses that are not the datasheet's: links, and a payload in the hand; and a torso that bends."""

from dataclasses import dataclass

import mujoco
import numpy as np

from twin.defects.defect import Defect, body
from twin.truth import Parameter


@dataclass(frozen=True)
class LinkMass(Defect):
    """Mass and centre of mass of a link.

    Attributes:
        link: The link's body.
        scale: True mass over nominal mass [-]; the inertia tensor scales with it.
        shift: Of the centre of mass, in link axes (3,) [m].
    """

    link: str
    scale: float
    shift: np.ndarray

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Scale and shift the link's inertial."""
        link = body(spec, self.link)
        link.mass = link.mass * self.scale
        link.inertia = link.inertia * self.scale
        link.fullinertia = link.fullinertia * self.scale
        link.ipos = link.ipos + self.shift

    def parameters(self) -> tuple[Parameter, ...]:
        """As departures from nominal: relative mass, and shift of the centre of mass."""
        shifts = zip(("cx", "cy", "cz"), self.shift, strict=True)
        return (
            Parameter(f"link.{self.link}.mass", "-", self.scale - 1.0),
            *(Parameter(f"link.{self.link}.{n}", "m", float(v)) for n, v in shifts),
        )


@dataclass(frozen=True)
class Payload(Defect):
    """A box in the hand.

    Attributes:
        link: Link that carries it.
        mass: [kg].
        com: In link axes (3,) [m].
        size: Edge lengths (3,) [m].
    """

    link: str
    mass: float
    com: np.ndarray
    size: np.ndarray

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Fix the box to the link."""
        if self.mass == 0.0:
            return
        box = body(spec, self.link).add_body(name="payload", pos=self.com)
        a, b, c = self.size**2
        box.mass, box.inertia = self.mass, self.mass / 12.0 * np.array([b + c, a + c, a + b])
        box.ipos, box.iquat, box.explicitinertial = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), True
        geom = box.add_geom(name="payload", type=mujoco.mjtGeom.mjGEOM_BOX, size=self.size / 2.0, mass=0.0, group=2)
        geom.contype, geom.conaffinity, geom.rgba = 0, 0, np.array([0.72, 0.53, 0.31, 1.0])

    def parameters(self) -> tuple[Parameter, ...]:
        """Mass, centre of mass and edges."""
        lengths = zip(("cx", "cy", "cz", "size_x", "size_y", "size_z"), (*self.com, *self.size), strict=True)
        return (
            Parameter("payload.mass", "kg", self.mass),
            *(Parameter(f"payload.{n}", "m", float(v)) for n, v in lengths),
        )
