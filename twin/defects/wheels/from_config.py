"""From what a scenario says of the base to its wheels on one of three grounds (`twin.defects.ground`)."""

import mjcf
from twin.config.base import Base, WheelType
from twin.defects.defect import Defect
from twin.defects.wheels.anchored_base import Anchored
from twin.defects.wheels.bushing import Bushing
from twin.defects.wheels.contact import Contact
from twin.defects.wheels.wheel import Wheel


def wheels_of(base: Base) -> tuple[Wheel, ...]:
    """The six wheels."""
    return tuple(_wheel(w, _type(base, w.name), base.wheels) for w in mjcf.wheels())


def ground(base: Base, wheels: tuple[Wheel, ...]) -> tuple[Defect, ...]:
    """What puts the robot on its wheels."""
    return (Anchored(wheels),) if base.wheels == "anchored" else wheels


def _type(base: Base, name: str) -> WheelType:
    front = base.caster_front if name.startswith("caster_front") else base.caster_back
    return base.drive if name.startswith("wheel") else front


def _wheel(nominal: mjcf.Wheel, of: WheelType, ground: str) -> Wheel:
    """A caster rides on its bushing with its fork, whose body is the parent of the rolling one."""
    return Wheel(
        nominal.name,
        nominal.body.replace("_2_link", "_1_link"),
        f"{nominal.name}_contact",
        nominal.centre,
        nominal.contact,
        bushing=None if ground == "rigid" else _bushing(of),
        footing=None if ground == "anchored" else _contact(of),
        turning_force=of.turning_force,
    )


def _bushing(of: WheelType) -> Bushing:
    return Bushing(of.stiffness, of.damping, of.torsion, of.torsion_damping, of.guide_friction)


def _contact(of: WheelType) -> Contact:
    return Contact(of.contact_stiffness, of.contact_damping, of.friction, of.torsional_friction, of.rolling_friction)
