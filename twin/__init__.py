"""A robot whose truth is known, the motions it makes and the instruments that watch it."""

from twin.build import Twin, build
from twin.campaign import record
from twin.config import TwinConfig
from twin.load_test import Stiffness, load_test, release_test
from twin.simulate import States, simulate

__all__ = [
    "States",
    "Stiffness",
    "Twin",
    "TwinConfig",
    "build",
    "load_test",
    "record",
    "release_test",
    "simulate",
]
