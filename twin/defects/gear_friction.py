"""Friction that holds a drive train's play, and a mesh that winds up along one way and unwinds along another.

    mesh:   tau = K_e dz(delta; gap) + J(delta)          delta = q_l - q_m
            J = k (delta - s),  ds/dt != 0 only while |J| = t_y      a spring in series with a slider (Jenkins element)
    link:   Coulomb friction grows by `holding`: the link stays in the gap while load and t_y together are below it

The slope of the mesh in contact is K_e + k after each reversal and K_e once the slider slips. Without load torque to
tell the flank, motion decides it: the link follows its motor as a play operator does. k and t_y are a tendon's
elasto-plastic spring. Reference: Lampaert, Al-Bender, Swevers, IEEE MMAR 2003 (Maxwell-slip elements).
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from twin.defects.defect import Defect, joint
from twin.defects.gear import mesh_tendon
from twin.errors import UnknownElement
from twin.truth import Parameter


@dataclass(frozen=True)
class GearFriction(Defect):
    """Friction of a geared joint's mesh and of its link; applied after its `Gear`.

    Attributes:
        joint_name: The joint.
        stiffness: k of the spring that slips [N.m/rad].
        slip: t_y at which it slips [N.m].
        holding: Further Coulomb friction of the link side [N.m].
    """

    joint_name: str
    stiffness: float
    slip: float
    holding: float

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Put the elasto-plastic spring on the mesh and the friction on the link."""
        link, mesh = joint(spec, self.joint_name), _tendon(spec, mesh_tendon(self.joint_name))
        link.frictionloss = link.frictionloss + self.holding
        if self.slip > 0.0:
            mesh.stiffness, mesh.springyield = np.array([self.stiffness, 0.0, 0.0]), self.slip / self.stiffness
            mesh.springlength = np.zeros(2)

    def parameters(self) -> tuple[Parameter, ...]:
        """Spring, slider and holding friction."""
        return (
            Parameter(f"hysteresis.{self.joint_name}.stiffness", "N.m/rad", self.stiffness),
            Parameter(f"hysteresis.{self.joint_name}.slip", "N.m", self.slip),
            Parameter(f"hysteresis.{self.joint_name}.holding", "N.m", self.holding),
        )


def _tendon(spec: mujoco.MjSpec, name: str) -> mujoco.MjsTendon:
    found = spec.tendon(name)
    if found is None:
        raise UnknownElement("mesh", name, (t.name for t in spec.tendons))
    return found
