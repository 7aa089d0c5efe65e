"""What makes a robot differ from nominal: edits of its specification that can be read back as numbers."""

from twin.defects.bending import Cable, Flexibility
from twin.defects.defect import Defect
from twin.defects.differential import Differential
from twin.defects.gear import Gear
from twin.defects.gear_friction import GearFriction
from twin.defects.inertia import LinkMass, Payload
from twin.defects.placement import Placement
from twin.defects.thermal_drift import Warming
from twin.defects.wheels.from_config import ground, wheels_of

__all__ = [
    "Cable",
    "Defect",
    "Differential",
    "Flexibility",
    "Gear",
    "GearFriction",
    "LinkMass",
    "Payload",
    "Placement",
    "Warming",
    "ground",
    "wheels_of",
]
