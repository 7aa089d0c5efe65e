"""Structures that bend: links at their joint, and harnesses that pull a joint.

cable     tau = -k (q - q_0)                            on the link
bending   tau = -k theta - c dtheta/dt                  about x and y of the link's frame
"""

from typing import Literal

import mujoco
import numpy as np
from pydantic.dataclasses import dataclass

from twin.defects.defect import Defect, body, joint
from twin.fields.values import STRICT, AtLeast1000, NonNegative, Value
from twin.truth import Parameter


@dataclass(frozen=True, config=STRICT)
class Cable(Defect):
    """A harness that pulls a joint towards an angle.

    Attributes:
        joint_name: The joint.
        stiffness: k [N.m/rad].
        rest: q_0 [rad].
        kind: Its name in a scenario.
    """

    joint_name: str
    stiffness: NonNegative
    rest: Value
    kind: Literal["cable"] = "cable"

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Put a spring on the joint."""
        pulled = joint(spec, self.joint_name)
        pulled.stiffness = np.array([self.stiffness, 0.0, 0.0])
        pulled.springref = np.degrees(self.rest) if spec.compiler.degree else self.rest

    def parameters(self) -> tuple[Parameter, ...]:
        """Stiffness and angle of rest."""
        name = f"cable.{self.joint_name}"
        return Parameter(f"{name}.stiffness", "N.m/rad", self.stiffness), Parameter(f"{name}.rest", "rad", self.rest)


@dataclass(frozen=True, config=STRICT)
class Flexibility(Defect):
    """A link that bends about its x and y axes where its joint carries it.

    Attributes:
        link: The link.
        stiffness: About x and y [N.m/rad].
        damping: About x and y [N.m.s/rad].
        kind: Its name in a scenario.
    """

    link: str
    stiffness: AtLeast1000
    damping: NonNegative
    kind: Literal["bending"] = "bending"

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Add two sprung hinges behind the link's own joint."""
        link = body(spec, self.link)
        for name, axis in (("rx", [1.0, 0.0, 0.0]), ("ry", [0.0, 1.0, 0.0])):
            link.add_joint(
                name=f"{self.link}.{name}",
                type=mujoco.mjtJoint.mjJNT_HINGE,
                axis=axis,
                stiffness=np.array([self.stiffness, 0.0, 0.0]),
                damping=np.array([self.damping, 0.0, 0.0]),
            )

    def parameters(self) -> tuple[Parameter, ...]:
        """Stiffness and damping about each axis."""
        return tuple(
            Parameter(f"flexibility.{self.link}.{kind}{axis}", unit, value)
            for axis in ("rx", "ry")
            for kind, unit, value in (("k", "N.m/rad", self.stiffness), ("c", "N.m.s/rad", self.damping))
        )
