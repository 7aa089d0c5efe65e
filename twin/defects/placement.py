"""Joint placements that are not where the datasheet says.

    M_j <- M_j exp6(xi_j)

on the right of each placement, before the joint's own motion; twist linear then angular, in the joint's frame.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from twin.defects.defect import Defect, joint
from twin.transforms import exp6, placement, transform
from twin.truth import Parameter, twist_parameters


@dataclass(frozen=True)
class Placement(Defect):
    """Error of one joint's placement.

    Attributes:
        joint_name: The joint.
        xi: Twist (6,), linear [m] then angular [rad].
    """

    joint_name: str
    xi: np.ndarray

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Move the body that carries the joint."""
        carrier = joint(spec, self.joint_name).parent
        carrier.pos, carrier.quat = placement(transform(carrier.pos, carrier.quat) @ exp6(self.xi))

    def parameters(self) -> tuple[Parameter, ...]:
        """The six numbers of the twist."""
        return twist_parameters(f"geometry.{self.joint_name}", self.xi)
