"""Gear friction: a link that stays within its backlash, and a mesh with hysteresis.

    mesh:   tau = K_e dz(delta; gap) + J(delta)          delta = q_l - q_m
            J = k (delta - s),  ds/dt != 0 only while |J| = t_y      a spring in series with a slider (Jenkins element)
    link:   Coulomb friction grows by `holding`: the link stays in the gap while load and t_y together are below it

The slope of the mesh in contact is K_e + k after each reversal and K_e once the slider slips. Without load torque to
select the flank, motion does: the link follows its motor as a play operator does. k and t_y are a tendon's
elasto-plastic spring. Reference: Lampaert, Al-Bender, Swevers, IEEE MMAR 2003 (Maxwell-slip elements).
"""

import mujoco
import numpy as np
from pydantic.dataclasses import dataclass

from twin.defects.defect import Defect, joint
from twin.defects.gear import mesh_tendon
from twin.errors import UnknownElement
from twin.fields.values import STRICT, NonNegative, Positive
from twin.truth import Parameter


@dataclass(frozen=True, config=STRICT)
class GearFriction(Defect):
    """Friction of a geared joint's mesh and of its link; applied after its `Gear`.

    Attributes:
        joint_name: The joint.
        stiffness: k of the spring that slips [N.m/rad].
        slip: t_y at which it slips [N.m].
        holding: Further Coulomb friction of the link side [N.m].
    """

    joint_name: str
    stiffness: Positive
    slip: NonNegative
    holding: NonNegative

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Put the elasto-plastic spring on the mesh and the friction on the link."""
        link, mesh = joint(spec, self.joint_name), _tendon(spec, mesh_tendon(self.joint_name))
        link.frictionloss = link.frictionloss + self.holding
        if self.slip > 0.0:
            mesh.stiffness, mesh.springyield = np.array([self.stiffness, 0.0, 0.0]), self.slip / self.stiffness
            mesh.springlength = np.zeros(2)

    def parameters(self) -> tuple[Parameter, ...]:
        """Spring, slider and holding friction."""
        return friction_parameters(self.joint_name, self.stiffness, self.slip, self.holding)


def friction_parameters(joint_name: str, stiffness: float, slip: float, holding: float) -> tuple[Parameter, ...]:
    """Spring [N.m/rad], slider and holding friction [N.m] as one joint shows them."""
    values = (("stiffness", "N.m/rad", stiffness), ("slip", "N.m", slip), ("holding", "N.m", holding))
    return tuple(Parameter(f"hysteresis.{joint_name}.{name}", unit, value) for name, unit, value in values)


def _tendon(spec: mujoco.MjSpec, name: str) -> mujoco.MjsTendon:
    found = spec.tendon(name)
    if found is None:
        raise UnknownElement("mesh", name, (t.name for t in spec.tendons))
    return found
