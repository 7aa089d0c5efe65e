"""A joint placement that drifts as the robot warms.

M_j(t) = M_j exp6(xi (1 - exp(-t / T)))         t since the campaign's start, taken at a trial's middle
"""

from typing import Literal

import mujoco
import numpy as np
from pydantic.dataclasses import dataclass

from twin.defects.defect import Defect, Trial
from twin.defects.placement import Placement
from twin.fields.values import STRICT, Positive, Twist
from twin.truth import Parameter, twist_parameters


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
