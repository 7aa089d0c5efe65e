"""Masses that are not the datasheet's: of the links, and of a payload in the hand."""

from dataclasses import replace
from typing import Annotated, Literal

import mujoco
import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from twin.defects.defect import Defect, Trial, body
from twin.fields.distributions import DRAWN
from twin.fields.names import HAND
from twin.fields.values import STRICT, NonNegative, Point, Positive, point
from twin.truth import Parameter


@dataclass(frozen=True, config=STRICT)
class LinkMass(Defect):
    """Mass and centre of mass of a link.

    Attributes:
        link: The link's body.
        scale: True mass over nominal mass [-]; the inertia tensor scales with it.
        shift: Of the centre of mass, in link axes [m].
        kind: Its name in a scenario.
    """

    link: str
    scale: Positive
    shift: Point
    kind: Literal["link_mass"] = "link_mass"

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


@dataclass(frozen=True, config=STRICT)
class Payload(Defect):
    """A box in the hand; the laboratory is given its nominal values.

    Attributes:
        mass: Mass [kg].
        com: Centre of mass in the axes of its link [m].
        size: Edge lengths of the box [m].
        com_error: Standard deviation of the true centre of mass, per axis [m].
        link: Link that carries it.
    """

    mass: Annotated[float, Field(ge=0.0, le=3.0), DRAWN]
    com: Point
    size: tuple[Positive, Positive, Positive]
    com_error: NonNegative = 0.0
    link: str = HAND

    def sample(self, rng: np.random.Generator) -> "Payload":
        """The box with its true centre of mass."""
        return replace(self, com=point(np.array(self.com) + self.com_error * rng.normal(size=3)), com_error=0.0)

    def at(self, trial: Trial, time: float) -> "Payload":
        """The box of the trial's mass."""
        return self if trial.payload is None else replace(self, mass=trial.payload)

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Fix the box to the link."""
        if self.mass == 0.0:
            return
        box = body(spec, self.link).add_body(name="payload", pos=self.com)
        a, b, c = np.array(self.size) ** 2
        box.mass, box.inertia = self.mass, self.mass / 12.0 * np.array([b + c, a + c, a + b])
        box.ipos, box.iquat, box.explicitinertial = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), True
        geom = box.add_geom(
            name="payload", type=mujoco.mjtGeom.mjGEOM_BOX, size=np.array(self.size) / 2.0, mass=0.0, group=2
        )
        geom.contype, geom.conaffinity, geom.rgba = 0, 0, np.array([0.72, 0.53, 0.31, 1.0])

    def parameters(self) -> tuple[Parameter, ...]:
        """Mass, centre of mass and edges."""
        lengths = zip(("cx", "cy", "cz", "size_x", "size_y", "size_z"), (*self.com, *self.size), strict=True)
        return (
            Parameter("payload.mass", "kg", self.mass),
            *(Parameter(f"payload.{n}", "m", float(v)) for n, v in lengths),
        )
