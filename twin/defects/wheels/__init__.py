"""What a base stands on: wheels on bushings and contacts, anchored in the floor, or rolling."""

from twin.defects.wheels.anchored_base import Anchored
from twin.defects.wheels.base import Base, ground, wheels_of
from twin.defects.wheels.bushing import Bushing
from twin.defects.wheels.contact import Contact
from twin.defects.wheels.stiffness import spatial_stiffness
from twin.defects.wheels.wheel import Wheel

__all__ = [
    "Anchored",
    "Base",
    "Bushing",
    "Contact",
    "Wheel",
    "ground",
    "spatial_stiffness",
    "wheels_of",
]
