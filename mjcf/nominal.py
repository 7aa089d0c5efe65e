"""The nominal robot on its floor, read from the MJCF files of this package."""

from functools import cache
from pathlib import Path

import mujoco

ROOT = "base_footprint"
"""Name of the body at the root of the robot, on the ground between the drive wheels, x forward, z up."""


def scene_path() -> Path:
    """Return the file to open in a MuJoCo viewer: laboratory, force plate and robot."""
    return Path(__file__).with_name("scene.xml")


def spec() -> mujoco.MjSpec:
    """Return a fresh, editable specification of the nominal robot standing on the force plate.

    Every body's orientation is a quaternion and every inertia a `fullinertia` (about the centre of mass, link
    axes): no other form has to be handled by whoever edits it.
    """
    return mujoco.MjSpec.from_file(str(scene_path()))


@cache
def model() -> mujoco.MjModel:
    """Return the compiled nominal robot, one for all who read it; who wants to change it compiles `spec()`."""
    return spec().compile()
