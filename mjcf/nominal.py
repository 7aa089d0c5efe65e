"""The nominal robot on its floor, read from the MJCF files of this package."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import mujoco
import numpy as np

_SUFFIX = "_contact"

Vector = tuple[float, float, float]
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


@dataclass(frozen=True)
class Wheel:
    """A wheel at rest, the casters trailing backwards.

    Attributes:
        name: `wheel_left`, `caster_front_left`, ...
        type: Driven by a motor, or free to roll and swivel.
        body: Name of the body that rolls.
        radius: Radius of the wheel [m].
        centre: Hub centre in base_footprint [m].
        contact: Point that touches the ground, in base_footprint [m].
    """

    name: str
    type: Literal["drive", "caster"]
    body: str
    radius: float
    centre: Vector
    contact: Vector


@cache
def wheels() -> tuple[Wheel, ...]:
    """Return the wheels of the nominal robot, drive wheels first.

    A wheel has a geom `<name>_contact`, a ball of its radius around its hub. A caster's body hangs on a swivel joint.
    """
    nominal = model()
    data = mujoco.MjData(nominal)
    mujoco.mj_kinematics(nominal, data)
    geoms = [i for i in range(nominal.ngeom) if nominal.geom(i).name.endswith(_SUFFIX)]
    found = [_wheel(nominal, data, i) for i in geoms]
    return tuple(sorted(found, key=lambda wheel: wheel.type != "drive"))


def _wheel(model: mujoco.MjModel, data: mujoco.MjData, geom_id: int) -> Wheel:
    """Return the wheel of a contact geom, `data` being at rest."""
    root, body_id = data.body(ROOT), model.geom_bodyid[geom_id]
    radius = float(model.geom_size[geom_id, 0])
    centre = root.xmat.reshape(3, 3).T @ (data.geom_xpos[geom_id] - root.xpos)
    swivels = model.body_jntnum[model.body_parentid[body_id]] > 0
    return Wheel(
        name=model.geom(geom_id).name.removesuffix(_SUFFIX),
        type="caster" if swivels else "drive",
        body=model.body(body_id).name,
        radius=radius,
        centre=_vector(centre),
        contact=_vector(centre - [0.0, 0.0, radius]),
    )


def _vector(p: np.ndarray) -> Vector:
    """Return a point as plain floats, nanometre dust swept off."""
    x, y, z = (round(float(value), 12) + 0.0 for value in p)
    return x, y, z
