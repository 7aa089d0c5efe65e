"""What a scenario says about the arm and the torso: drive trains and encoders; SI units."""

from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic.dataclasses import dataclass

from twin.config.distributions import DRAWN
from twin.config.names import ARM, ArmLinkName, ArmName
from twin.config.values import STRICT, Angle, NonNegative, Point, Positive, in_order


@dataclass(frozen=True, config=STRICT)
class ArmJoint:
    """Drive train and encoders of one arm joint.

    Attributes:
        offset: Motor encoder's reading at true zero [rad].
        gap: Total play [rad].
        stiffness: Mesh [N.m/rad].
        damping: Mesh [N.m.s/rad].
        coulomb: Link-side friction [N.m].
        viscous: Link-side friction [N.m.s/rad].
        rotor_inertia: Reflected to the joint [kg.m2].
        servo_stiffness: Position gain [N.m/rad].
        quantum: Of the motor encoder, at the joint [rad].
        torque_per_ampere: Of the drive, at the joint [N.m/A].
    """

    offset: Angle
    gap: Annotated[float, Field(ge=0.0, le=0.1), DRAWN]
    stiffness: Annotated[float, Field(ge=100.0, le=50e3), DRAWN]
    damping: NonNegative
    coulomb: NonNegative
    viscous: NonNegative
    rotor_inertia: Annotated[float, Field(ge=0.01), DRAWN]
    servo_stiffness: Positive
    quantum: Positive
    torque_per_ampere: Positive


def _whole(arm: dict[ArmName, ArmJoint]) -> dict[ArmName, ArmJoint]:
    if missing := [name for name in ARM if name not in arm]:
        raise ValueError(f"an arm has seven joints, arm_1_joint to arm_7_joint; there is no {', '.join(missing)}")
    return arm


Arm = Annotated[dict[ArmName, ArmJoint], AfterValidator(_whole), in_order(ARM)]
"""Every joint of the arm, base to tip."""


@dataclass(frozen=True, config=STRICT)
class FrictionHeld:
    """What the form `friction_held` adds to a joint's gear; see `twin.defects.hysteresis`.

    Attributes:
        holding: Further Coulomb friction of the link [N.m].
        slip: Torque at which the mesh's friction slips [N.m].
        stiffness: Of the mesh below it, beside the mesh's own [N.m/rad].
    """

    holding: NonNegative
    slip: NonNegative
    stiffness: Positive


SomeHeld = Annotated[dict[ArmName, FrictionHeld], in_order(ARM)]
"""Some joints of the arm, base to tip."""
FRICTION_HELD: dict[ArmName, FrictionHeld] = {
    **{f"arm_{i}_joint": FrictionHeld(holding=0.4, slip=3.0, stiffness=9000.0) for i in (1, 2)},
    **{f"arm_{i}_joint": FrictionHeld(holding=0.5, slip=2.0, stiffness=6000.0) for i in (3, 4)},
    **{f"arm_{i}_joint": FrictionHeld(holding=3.0, slip=0.4, stiffness=1000.0) for i in (5, 6)},
    "arm_7_joint": FrictionHeld(holding=1.0, slip=0.4, stiffness=1000.0),
}
"""Links held with the friction the URDF states, 1 N.m, and geared wrist joints with more than the gravity they carry,
1.2 N.m and as much again of payload; slip such that the unloaded loop is 0.7-0.8 mrad wide, 2 arc minutes, a
strain-wave catalogue's hysteresis loss."""


@dataclass(frozen=True, config=STRICT)
class LinkEncoders:
    """Absolute encoders on the link side, standard deviations of what is drawn.

    Attributes:
        offset: Zero [rad].
        once: Amplitude once per turn [rad].
        twice: Amplitude twice per turn [rad].
        quantum: Step of the reading [rad].
    """

    offset: NonNegative
    once: NonNegative
    twice: NonNegative
    quantum: Positive


@dataclass(frozen=True, config=STRICT)
class MotorEncoders:
    """Eccentricity of the motor-side encoders as seen at the joint, standard deviations of what is drawn.

    Attributes:
        once: Amplitude once per turn of the joint [rad].
        twice: Amplitude twice per turn [rad].
    """

    once: NonNegative = 0.0
    twice: NonNegative = 0.0


@dataclass(frozen=True, config=STRICT)
class Torso:
    """The torso lift, driven without play, and its column's bending.

    Attributes:
        quantum: Of the motor encoder [m].
        force_per_ampere: [N/A].
        servo_stiffness: [N/m].
        rotor_inertia: Reflected [kg].
        bending_stiffness: About x and y [N.m/rad].
        bending_damping: [N.m.s/rad].
    """

    quantum: Positive
    force_per_ampere: Positive
    servo_stiffness: Positive
    rotor_inertia: Positive
    bending_stiffness: Annotated[float, Field(ge=1e3), DRAWN]
    bending_damping: NonNegative


@dataclass(frozen=True, config=STRICT)
class Load:
    """The payload, declared to the laboratory as it stands here.

    Attributes:
        mass: [kg].
        com: In the tool frame [m].
        size: Edge lengths [m].
        com_error: Standard deviation of the true centre of mass, per axis [m].
    """

    mass: Annotated[float, Field(ge=0.0, le=3.0), DRAWN]
    com: Point
    size: tuple[Positive, Positive, Positive]
    com_error: NonNegative


@dataclass(frozen=True, config=STRICT)
class Widths:
    """What differs from one robot of the series to the next, standard deviations unless said.

    Attributes:
        placement_translation: Each joint placement, per axis [m].
        placement_rotation: Each joint placement, per axis [rad].
        link_mass: Relative [-].
        link_com: Per axis [m].
        mount_translation: Where the arm is bolted on, per axis, on top of its first joint's placement [m].
        mount_rotation: The same, per axis [rad].
        spread: Half width of the uniform factor on offsets and gaps [-]; 0 leaves them as written.
        makes: Arms of other makes, of which a robot has one: masses of its links over the datasheet's [-], 1 where
            none is given. Without any, the datasheet's.
    """

    placement_translation: NonNegative
    placement_rotation: NonNegative
    link_mass: Annotated[float, Field(ge=0.0, le=0.3), DRAWN]
    link_com: NonNegative
    spread: Annotated[float, Field(ge=0.0, le=0.9), DRAWN] = 0.0
    mount_translation: NonNegative = 0.0
    mount_rotation: NonNegative = 0.0
    makes: tuple[dict[ArmLinkName, Annotated[float, Field(ge=0.3, le=3.0), DRAWN]], ...] = ()
