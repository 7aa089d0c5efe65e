"""A drive train with backlash: rotor, mesh with a dead zone, link. The load's torque decides which flank is in contact.

    rotor: J_m dd q_m = kp (u - q_m) - kv d q_m - tau        motor side; the motor encoder reads q_m
    mesh:  tau = K dz(q_m - q_l; gap) + D d/dt(...)          in contact only, dz the dead zone of TOTAL width gap
    link:  ... dd q_l = tau - f_c sign(d q_l) - f_v d q_l    the link encoder reads q_l

The rotor is a sibling body of the link on the same axis, so that the reaction acts on the parent; the mesh is a fixed
tendon q_l - q_m limited to +-gap/2 whose soft limit is the spring. With constant impedance d the limit's stiffness is
K = S / ((1 - d) iw) with iw the tendon's inverse weight in the compiled model: S is set from it after each compile.
`twin.defects.gear_friction` adds the friction of the mesh, `twin.defects.differential` couples two such trains.
"""

import mujoco
import numpy as np
from pydantic.dataclasses import dataclass

from twin.defects.defect import Defect, joint
from twin.fields.values import STRICT, NonNegative, Positive
from twin.truth import Parameter

_IMPEDANCE = 0.02
_ROTOR_MASS = 1e-4  # [kg] a moving body must have some
_ROTOR_INERTIA = 1e-8  # [kg.m2] of the body itself; the rotor's real inertia is its armature
_DAMPING_RATIO = 1.2  # servo velocity gain over sqrt(kp J), where none is given
_OPEN = 1e-9  # [rad] half width in place of no backlash at all


def rotor_joint(joint_name: str) -> str:
    """Name of the motor-side joint of a geared joint."""
    return f"{joint_name}.motor"


def mesh_tendon(joint_name: str) -> str:
    """Name of the tendon that is the mesh of a geared joint; its length is link minus motor [rad]."""
    return f"{joint_name}.mesh"


@dataclass(frozen=True, config=STRICT)
class Gear(Defect):
    """Gear of one joint.

    Attributes:
        joint_name: The joint.
        gap: Total backlash [rad].
        stiffness: Mesh stiffness in contact [N.m/rad].
        damping: Mesh damping in contact [N.m.s/rad].
        coulomb: Coulomb friction on the link side [N.m].
        viscous: Viscous friction on the link side [N.m.s/rad].
        rotor_inertia: Rotor inertia, reflected to the joint [kg.m2].
        servo_stiffness: Position gain on the motor side [N.m/rad].
        link_inertia: Inertia of the output gear, fixed to the link [kg.m2].
        servo_damping: Velocity gain on the motor side [N.m.s/rad]; None: 1.2 sqrt(servo_stiffness rotor_inertia).
    """

    joint_name: str
    gap: NonNegative
    stiffness: Positive
    damping: NonNegative
    coulomb: NonNegative
    viscous: NonNegative
    rotor_inertia: Positive
    servo_stiffness: Positive
    link_inertia: NonNegative = 0.004
    servo_damping: NonNegative | None = None

    @property
    def servo_gains(self) -> tuple[float, float]:
        """Position gain [N.m/rad] and velocity gain [N.m.s/rad] on the motor side."""
        return _gains(self.servo_stiffness, self.servo_damping, self.rotor_inertia)

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Add the rotor, the mesh and the servo."""
        self.add_rotor(spec)
        mesh = {self.joint_name: 1.0, rotor_joint(self.joint_name): -1.0}
        add_mesh(spec, mesh_tendon(self.joint_name), mesh, self.gap)
        add_servo(spec, rotor_joint(self.joint_name), *self.servo_gains)

    def add_rotor(self, spec: mujoco.MjSpec) -> None:
        """Give the link its friction and output gear, and add the rotor beside it."""
        link_joint = joint(spec, self.joint_name)
        link_joint.frictionloss = self.coulomb
        link_joint.damping = np.array([self.viscous, 0.0, 0.0])
        link_joint.armature = self.link_inertia
        link = link_joint.parent
        rotor = link.parent.add_body(name=f"{self.joint_name}.rotor", pos=link.pos, quat=link.quat)
        rotor.mass, rotor.inertia, rotor.explicitinertial = _ROTOR_MASS, np.full(3, _ROTOR_INERTIA), True
        rotor.ipos, rotor.iquat = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
        name = rotor_joint(self.joint_name)
        rotor.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=link_joint.axis, armature=self.rotor_inertia)

    def tune(self, model: mujoco.MjModel) -> None:
        """Turn stiffness and damping into the limit's reference parameters."""
        tune_mesh(model, mesh_tendon(self.joint_name), self.stiffness, self.damping)

    def parameters(self) -> tuple[Parameter, ...]:
        """Play, compliance and friction."""
        j = self.joint_name
        return (
            Parameter(f"backlash.{j}.gap", "rad", self.gap),
            Parameter(f"gear.{j}.compliance", "rad/(N.m)", 1.0 / self.stiffness),
            Parameter(f"gear.{j}.damping", "N.m.s/rad", self.damping),
            Parameter(f"gear.{j}.rotor_inertia", "kg.m2", self.rotor_inertia),
            Parameter(f"gear.{j}.link_inertia", "kg.m2", self.link_inertia),
            Parameter(f"gear.{j}.servo_stiffness", "N.m/rad", self.servo_stiffness),
            Parameter(f"gear.{j}.servo_damping", "N.m.s/rad", self.servo_gains[1]),
            Parameter(f"friction.{j}.coulomb", "N.m", self.coulomb),
            Parameter(f"friction.{j}.viscous", "N.m.s/rad", self.viscous),
        )


@dataclass(frozen=True, config=STRICT)
class DirectDrive(Defect):
    """A sliding joint whose motor is fixed to it without backlash: the torso's spindle.

    Attributes:
        joint_name: The joint.
        rotor_inertia: Reflected [kg].
        servo_stiffness: Position gain [N/m].
        servo_damping: Velocity gain [N.s/m]; None: 1.2 sqrt(servo_stiffness rotor_inertia).
    """

    joint_name: str
    rotor_inertia: Positive
    servo_stiffness: Positive
    servo_damping: NonNegative | None = None

    @property
    def servo_gains(self) -> tuple[float, float]:
        """Position gain [N/m] and velocity gain [N.s/m]."""
        return _gains(self.servo_stiffness, self.servo_damping, self.rotor_inertia)

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Add rotor inertia and servo."""
        joint(spec, self.joint_name).armature = self.rotor_inertia
        add_servo(spec, self.joint_name, *self.servo_gains)

    def parameters(self) -> tuple[Parameter, ...]:
        """Rotor and servo."""
        name = f"gear.{self.joint_name}"
        return (
            Parameter(f"{name}.rotor_inertia", "kg", self.rotor_inertia),
            Parameter(f"{name}.servo_stiffness", "N/m", self.servo_stiffness),
            Parameter(f"{name}.servo_damping", "N.s/m", self.servo_gains[1]),
        )


def add_mesh(spec: mujoco.MjSpec, name: str, coefficients: dict[str, float], gap: float) -> None:
    """Limit a linear combination of joint positions to +-gap/2."""
    mesh = spec.add_tendon(name=name, limited=True)
    for joint_name, coefficient in coefficients.items():
        mesh.wrap_joint(joint_name, coefficient)
    mesh.range = np.array([-0.5, 0.5]) * max(gap, 2.0 * _OPEN)
    mesh.solimp_limit = np.array([_IMPEDANCE, _IMPEDANCE, 0.001, 0.5, 2.0])


def tune_mesh(model: mujoco.MjModel, name: str, stiffness: float, damping: float) -> None:
    """Give the limit of a mesh its stiffness [N.m/rad] and damping [N.m.s/rad]."""
    i = model.tendon(name).id
    scale = (1.0 - _IMPEDANCE) * model.tendon_invweight0[i]
    model.tendon_solref_lim[i] = -stiffness * scale, -damping * scale


def _gains(stiffness: float, damping: float | None, inertia: float) -> tuple[float, float]:
    return stiffness, _DAMPING_RATIO * float(np.sqrt(stiffness * inertia)) if damping is None else damping


def add_servo(spec: mujoco.MjSpec, joint_name: str, stiffness: float, damping: float) -> None:
    """Position servo: force = kp (u - q) - kv dq, named after the joint it drives."""
    servo = spec.add_actuator(name=joint_name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint_name)
    servo.gaintype, servo.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
    servo.gainprm = np.array([stiffness, *np.zeros(9)])
    servo.biasprm = np.array([0.0, -stiffness, -damping, *np.zeros(7)])
