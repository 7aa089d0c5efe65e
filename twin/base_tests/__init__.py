"""Tests of the base: load and release test, gravity stiffness, slip load, replayed wrenches."""

from twin.base_tests.gravity_stiffness import gravity_stiffness
from twin.base_tests.load_test import LoadTestFailed, Stiffness, load_test, release_test
from twin.base_tests.slip_load import normal_forces, slip_loads
from twin.base_tests.wrench_replay import WrenchHistory, massless_base, massless_base_on, replay

__all__ = [
    "LoadTestFailed",
    "Stiffness",
    "WrenchHistory",
    "gravity_stiffness",
    "load_test",
    "massless_base",
    "massless_base_on",
    "normal_forces",
    "release_test",
    "replay",
    "slip_loads",
]
