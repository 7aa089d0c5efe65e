"""A robot whose truth is known, the motions it makes and the instruments that measure it.

    lab = laboratory(load("humanoids2024").twin, seed)      the robot of a seed in its laboratory
    states = simulate(lab.twin, motion, lab.T_lab_base)     what a motion does to it

Importing this package is cheap: a name is loaded where it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from twin.base_tests import load_test
    from twin.campaign.laboratory_model import Laboratory, laboratory
    from twin.campaign.recording import record
    from twin.campaign.robot import Robot, sample
    from twin.config import TwinConfig
    from twin.motions import Motion
    from twin.simulation import States, Twin, build, simulate

__all__ = [
    "Laboratory",
    "Motion",
    "Robot",
    "States",
    "Twin",
    "TwinConfig",
    "build",
    "laboratory",
    "load_test",
    "record",
    "sample",
    "simulate",
]

_FACES = {
    "twin.base_tests": ("load_test",),
    "twin.campaign": ("Laboratory", "Robot", "laboratory", "record", "sample"),
    "twin.config": ("TwinConfig",),
    "twin.motions": ("Motion",),
    "twin.simulation": ("States", "Twin", "build", "simulate"),
}


def __getattr__(name: str) -> Any:
    """The public name, from the package it is in."""
    for face, names in _FACES.items():
        if name in names:
            return getattr(import_module(face), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
