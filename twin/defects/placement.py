"""Joint placements that differ from the datasheet's.

    M_j <- M_j exp6(xi_j)

on the right of each placement, before the joint's own motion; twist linear then angular, in the joint's frame. One that
drifts as the robot warms, t since the campaign's start, taken at a trial's middle:

    M_j(t) = M_j exp6(xi (1 - exp(-t / T)))
"""

from typing import Literal

import mujoco
import numpy as np
from pydantic.dataclasses import dataclass

from twin.defects.defect import Defect, Trial, joint
from twin.fields.values import STRICT, Positive, Twist
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


@dataclass(frozen=True, config=STRICT)
class ThermalDrift(Defect):
    """Drift of a joint's placement with temperature; the placement is constant within a trial.

    Attributes:
        joint_name: The joint.
        xi: Twist once warm, linear [m] then angular [rad].
        time_constant: T [s].
        kind: Its name in a scenario.
    """

    joint_name: str
    xi: Twist
    time_constant: Positive
    kind: Literal["thermal_drift"] = "thermal_drift"

    def at(self, trial: Trial, time: float) -> Placement:
        """The placement's error at t = `time`."""
        return Placement(self.joint_name, np.array(self.xi) * -np.expm1(-time / self.time_constant))

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Leave the robot cold."""

    def parameters(self) -> tuple[Parameter, ...]:
        """The twist once warm, and the time constant."""
        name = f"warming.{self.joint_name}"
        return (*twist_parameters(name, np.array(self.xi)), Parameter(f"{name}.time_constant", "s", self.time_constant))
