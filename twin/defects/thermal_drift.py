"""Departures that no model of the pipeline holds: warming, a floor out of level, a cable, a loose marker.

    placement  M_j(t) = M_j exp6(xi (1 - exp(-t / T)))          t since the campaign's start, taken at a trial's middle
    floor      g = R(tilt)' (0, 0, -9.81)                       the lab's axes lie in the floor
    cable      tau = -k (q - q_0)                               on the link
    marker     y = p - a (0, 0, 1)                              hangs by its play a, from t_0 on

A link that bends is `twin.defects.loads.Flexibility`.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from twin.defects.defect import Defect, joint
from twin.transforms import exp6, placement, transform
from twin.truth import Parameter, twist_parameters


@dataclass(frozen=True)
class Warming(Defect):
    """Drift of a joint's placement with temperature.

    Attributes:
        joint_name: The joint.
        xi: Twist once warm (6,), linear [m] then angular [rad].
        time_constant: T [s].
        time: t of the trial concerned [s]; constant within it.
    """

    joint_name: str
    xi: np.ndarray
    time_constant: float
    time: float = 0.0

    @property
    def now(self) -> np.ndarray:
        """Twist at the trial's time (6,)."""
        return self.xi * -np.expm1(-self.time / self.time_constant)

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Move the body that carries the joint, after its own placement."""
        carrier = joint(spec, self.joint_name).parent
        carrier.pos, carrier.quat = placement(transform(carrier.pos, carrier.quat) @ exp6(self.now))

    def parameters(self) -> tuple[Parameter, ...]:
        """The twist once warm, and the time constant."""
        name = f"warming.{self.joint_name}"
        return (*twist_parameters(name, self.xi), Parameter(f"{name}.time_constant", "s", self.time_constant))
