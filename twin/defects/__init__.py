"""What makes a robot differ from nominal: edits of its specification that can be read back as numbers."""

from twin.defects.bending import Cable, Flexibility
from twin.defects.defect import Defect
from twin.defects.floor_tilt import FloorTilt
from twin.defects.gear import Gear
from twin.defects.gear_friction import GearFriction
from twin.defects.inertia import LinkMass
from twin.defects.placement import Placement, ThermalDrift
from twin.defects.wheels.base import Base, ground, wheels_of

DEFECTS: tuple[type[Defect], ...] = (
    Cable,
    Flexibility,
    FloorTilt,
    LinkMass,
    Placement,
    ThermalDrift,
)
"""Those that a scenario may list under `twin.defects`, by their `kind`."""

__all__ = [
    "DEFECTS",
    "Base",
    "Cable",
    "Defect",
    "Flexibility",
    "Gear",
    "GearFriction",
    "LinkMass",
    "Placement",
    "ThermalDrift",
    "ground",
    "wheels_of",
]
