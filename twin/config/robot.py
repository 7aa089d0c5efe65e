"""The robot above its base as a scenario describes it: drive trains, encoders, and what differs from robot to robot.

SI units.
"""

from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic.dataclasses import dataclass

from twin.defects.gear import Gear
from twin.defects.gear_friction import GearFriction
from twin.fields.distributions import DRAWN
from twin.fields.names import ARM, ArmLinkName, ArmName
from twin.fields.values import STRICT, Angle, AtLeast1000, Keyed, NonNegative, Positive, in_order


@dataclass(frozen=True, config=STRICT, kw_only=True)
class ArmJoint(Gear):
    """Drive train and encoders of one arm joint.

    Attributes:
        gap: Total backlash [rad].
        stiffness: Mesh stiffness in contact [N.m/rad].
        damping: Mesh damping in contact [N.m.s/rad].
        coulomb: Coulomb friction on the link side [N.m].
        viscous: Viscous friction on the link side [N.m.s/rad].
        rotor_inertia: Rotor inertia, reflected to the joint [kg.m2].
        servo_stiffness: Position gain on the motor side [N.m/rad].
        link_inertia: Inertia of the output gear, fixed to the link [kg.m2].
        servo_damping: Velocity gain on the motor side [N.m.s/rad]; None: 1.2 sqrt(servo_stiffness rotor_inertia).
        offset: Motor encoder's reading at true zero [rad].
        quantum: Step of the motor encoder, at the joint [rad].
        torque_per_ampere: Torque per motor current, at the joint [N.m/A].
    """

    gap: Annotated[float, Field(ge=0.0, le=0.1), DRAWN]
    stiffness: Annotated[float, Field(ge=100.0, le=50e3), DRAWN]
    rotor_inertia: Annotated[float, Field(ge=0.01), DRAWN]
    offset: Angle
    quantum: Positive
    torque_per_ampere: Positive


def _whole(arm: dict[ArmName, ArmJoint]) -> dict[ArmName, ArmJoint]:
    if missing := [name for name in ARM if name not in arm]:
        raise ValueError(f"an arm has seven joints, arm_1_joint to arm_7_joint; there is no {', '.join(missing)}")
    return arm


Arm = Annotated[dict[ArmName, ArmJoint], Keyed("joint_name"), AfterValidator(_whole), in_order(ARM)]
"""Every joint of the arm, base to tip."""


SomeHeld = Annotated[dict[ArmName, GearFriction], Keyed("joint_name"), in_order(ARM)]
"""Some joints of the arm, base to tip."""
_HELD = {1: (9000.0, 3.0, 0.4), 3: (6000.0, 2.0, 0.5), 5: (1000.0, 0.4, 3.0), 7: (1000.0, 0.4, 1.0)}
FRICTION_HELD: dict[ArmName, GearFriction] = {
    name: GearFriction(name, *_HELD[k - 1 + k % 2]) for k, name in enumerate(ARM, 1)
}
"""Friction of the links as the URDF states it, 1 N.m, and geared wrist joints with more than the gravity they carry,
1.2 N.m and as much again of payload; slip such that the unloaded loop is 0.7-0.8 mrad wide, 2 arc minutes, a
strain-wave catalogue's hysteresis loss."""


@dataclass(frozen=True, config=STRICT)
class Torso:
    """The torso lift, driven without backlash, and its column's bending.

    Attributes:
        quantum: Step of the motor encoder [m].
        force_per_ampere: Force per motor current [N/A].
        servo_stiffness: Position gain [N/m].
        rotor_inertia: Rotor inertia, reflected to the lift [kg].
        bending_stiffness: Of the column, about x and y [N.m/rad].
        bending_damping: Of the column, about x and y [N.m.s/rad].
    """

    quantum: Positive
    force_per_ampere: Positive
    servo_stiffness: Positive
    rotor_inertia: Positive
    bending_stiffness: AtLeast1000
    bending_damping: NonNegative


@dataclass(frozen=True, config=STRICT)
class Widths:
    """What differs from one robot of the series to the next, standard deviations unless stated.

    Attributes:
        placement_translation: Of each joint placement, per axis [m].
        placement_rotation: Of each joint placement, per axis [rad].
        link_mass: Of each link's mass, relative [-].
        link_com: Of each link's centre of mass, per axis [m].
        mount_translation: Of where the arm is mounted, per axis, in addition to its first joint's placement [m].
        mount_rotation: Of how the arm is mounted, per axis [rad].
        spread: Half width of the uniform factor on gap, offset, stiffness and friction of each gear and on stiffness
            and friction of each type of wheel [-]; 0 leaves them as written.
        gaps_and_offsets: The same for gaps and offsets alone, used where wider than `spread` [-].
        makes: Arms of other makes, of which a robot has one: masses of its links over the datasheet's [-], 1 where
            none is given. Without any, the datasheet's.
    """

    placement_translation: NonNegative
    placement_rotation: NonNegative
    link_mass: Annotated[float, Field(ge=0.0, le=0.3), DRAWN]
    link_com: NonNegative
    spread: Annotated[float, Field(ge=0.0, le=0.9), DRAWN] = 0.0
    gaps_and_offsets: Annotated[float, Field(ge=0.0, le=0.9), DRAWN] = 0.0
    mount_translation: NonNegative = 0.0
    mount_rotation: NonNegative = 0.0
    makes: tuple[dict[ArmLinkName, Annotated[float, Field(ge=0.3, le=3.0), DRAWN]], ...] = ()
