"""A robot whose truth is known, the motions it makes and the instruments that watch it."""

from twin.build import Twin, build
from twin.campaign import record
from twin.config import TwinConfig
from twin.gravity import gravity_stiffness
from twin.load_test import Stiffness, load_test, release_test
from twin.simulate import States, simulate
from twin.slip import slip_loads

__all__ = [
    "States",
    "Stiffness",
    "Twin",
    "TwinConfig",
    "build",
    "gravity_stiffness",
    "load_test",
    "record",
    "release_test",
    "simulate",
    "slip_loads",
]
