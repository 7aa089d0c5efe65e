"""The base as a scenario describes it, and its six wheels on one of three grounds (`twin.defects.wheels.wheel`)."""

from typing import Literal

from pydantic import ValidationInfo, field_validator
from pydantic.dataclasses import dataclass

import mjcf
from twin.defects.defect import Defect
from twin.defects.wheels.anchored_base import Anchored
from twin.defects.wheels.bushing import Bushing
from twin.defects.wheels.contact import Contact
from twin.defects.wheels.wheel import Wheel
from twin.fields.values import STRICT, NonNegative, Point, Positive, Vector3


@dataclass(frozen=True, config=STRICT)
class WheelType:
    """How one type of wheel stands.

    Attributes:
        stiffness: Bushing kx, ky, kz [N/m].
        damping: Bushing cx, cy, cz [N.s/m].
        contact_stiffness: Normal stiffness of the contact [N/m].
        contact_damping: Damping of the contact along the normal, which slip needs as well [N.s/m].
        friction: Coulomb friction coefficient mu of the contact [-].
        torsion: Bushing krx, kry, krz [N.m/rad]: krz alone, or all three; 0: fixed to the base about that axis.
        torsion_damping: Bushing crx, cry, crz [N.m.s/rad].
        torsional_friction: Friction moment of the contact about its normal, over the normal force [m].
        rolling_friction: Friction moment of the contact about a tangent, over the normal force [m].
        guide_friction: Coulomb friction of the bushing along z [N]; smaller changes of load deform the contact alone.
        turning_force: Force along x or y at which a caster turns instead of sliding, at any load [N]; 0: never.
    """

    stiffness: tuple[Positive, Positive, Positive]
    damping: tuple[NonNegative, NonNegative, NonNegative]
    contact_stiffness: Positive
    contact_damping: Positive
    friction: NonNegative
    torsion: tuple[NonNegative, NonNegative, NonNegative] = (0.0, 0.0, 0.0)
    torsion_damping: tuple[NonNegative, NonNegative, NonNegative] = (0.0, 0.0, 0.0)
    torsional_friction: NonNegative = 0.02
    rolling_friction: NonNegative = 0.02
    guide_friction: NonNegative = 0.0
    turning_force: NonNegative = 0.0

    @field_validator("torsion")
    @classmethod
    def _carried(cls, torsion: Vector3) -> Vector3:
        """A wheel that can tilt about one tangent alone would roll away."""
        if (torsion[0] > 0.0) != (torsion[1] > 0.0) or (torsion[0] > 0.0 and torsion[2] == 0.0):
            raise ValueError("torsional stiffness about z alone or about x, y and z; the others must be 0")
        return torsion

    @field_validator("torsion_damping")
    @classmethod
    def _twisting(cls, damping: Vector3, info: ValidationInfo) -> Vector3:
        """A wheel fixed to the base does not turn against it."""
        if any(c > 0.0 and k == 0.0 for c, k in zip(damping, info.data.get("torsion", damping), strict=True)):
            raise ValueError("torsional damping needs torsional stiffness about the same axis")
        return damping


@dataclass(frozen=True, config=STRICT)
class Base:
    """How the base stands.

    Attributes:
        drive: The two driven wheels, braked.
        caster_front: The two casters in front.
        caster_back: The two casters behind; each pair stands as the last drive has turned it.
        pose: x, y [m] and yaw [rad] of the base in the lab.
        wheels: `contact`: on bushings, by contacts that stick and slip; `anchored`: on bushings whose lower ends are
            fixed in the floor, a linear base; `rigid`: without bushings, on soft contacts alone.
    """

    drive: WheelType
    caster_front: WheelType
    caster_back: WheelType
    pose: Point
    wheels: Literal["contact", "anchored", "rigid"] = "contact"

    @field_validator("wheels")
    @classmethod
    def _guided(cls, wheels: str, info: ValidationInfo) -> str:
        """Anchored wheels are linear, rigid ones have no guides, braked ones do not turn."""
        types = [(k, info.data.get(k)) for k in ("drive", "caster_front", "caster_back")]
        if wheels != "contact" and any(t is not None and t.guide_friction > 0.0 for _, t in types):
            raise ValueError(f"guide_friction needs wheels: contact, found {wheels}; set it to 0 for all three types")
        if any(t is not None and t.turning_force > 0.0 and (wheels != "contact" or k == "drive") for k, t in types):
            raise ValueError(f"turning_force is of casters and needs wheels: contact, found {wheels}; set it to 0")
        return wheels


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
