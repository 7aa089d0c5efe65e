"""A floor out of level.

g = R(tilt)' (0, 0, -9.81)          the lab's axes lie in the floor
"""

from typing import Annotated, Literal

import mujoco
from pydantic import Field
from pydantic.dataclasses import dataclass
from scipy.spatial.transform import Rotation

from twin.defects.defect import Defect
from twin.fields.distributions import DRAWN
from twin.fields.values import STRICT
from twin.truth import Parameter

Tilt = Annotated[float, Field(ge=-0.05, le=0.05), DRAWN]


@dataclass(frozen=True, config=STRICT)
class FloorTilt(Defect):
    """A floor out of level.

    Attributes:
        rotation: Of the floor, and of the lab's axes with it, about the level's x and y axes, a rotation vector [rad].
        kind: Its name in a scenario.
    """

    rotation: tuple[Tilt, Tilt]
    kind: Literal["floor_tilt"] = "floor_tilt"

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Turn gravity in the lab."""
        R_level_lab = Rotation.from_rotvec([*self.rotation, 0.0])
        spec.option.gravity = R_level_lab.inv().apply(spec.option.gravity)

    def parameters(self) -> tuple[Parameter, ...]:
        """The rotation vector."""
        return tuple(Parameter(f"floor.tilt.{a}", "rad", v) for a, v in zip(("rx", "ry"), self.rotation, strict=True))
