"""A robot whose truth is known, the motions it makes and the instruments that watch it."""

from twin.base_tests.gravity_stiffness import gravity_stiffness
from twin.base_tests.load_test import Stiffness, load_test, release_test
from twin.base_tests.slip_load import slip_loads
from twin.campaign.record import record
from twin.config.twin import TwinConfig
from twin.simulation.build import Twin, build
from twin.simulation.rollout import simulate
from twin.simulation.states import States

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
