"""Joint placements that differ from the datasheet's.

    M_j <- M_j exp6(xi_j)

on the right of each placement, before the joint's own motion; twist linear then angular, in the joint's frame.
"""

from typing import Literal

import mujoco
import numpy as np
from pydantic.dataclasses import dataclass

from twin.defects.defect import Defect, joint
from twin.fields.values import STRICT, Twist
from twin.transforms import exp6, placement, transform
from twin.truth import Parameter, twist_parameters


@dataclass(frozen=True, config=STRICT)
class Placement(Defect):
    """Error of one joint's placement.

    Attributes:
        joint_name: The joint.
        xi: Twist, linear [m] then angular [rad].
        kind: Its name in a scenario.
    """

    joint_name: str
    xi: Twist
    kind: Literal["placement"] = "placement"

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Move the body that carries the joint."""
        carrier = joint(spec, self.joint_name).parent
        carrier.pos, carrier.quat = placement(transform(carrier.pos, carrier.quat) @ exp6(np.array(self.xi)))

    def parameters(self) -> tuple[Parameter, ...]:
        """The six numbers of the twist."""
        return twist_parameters(f"geometry.{self.joint_name}", np.array(self.xi))
