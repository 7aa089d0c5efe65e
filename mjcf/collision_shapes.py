"""Shapes of a body as URDF collision elements: what a planner may know of the robot's extent.

Geoms of group 2, those that are seen. A capsule becomes a cylinder and its two end spheres; an ellipsoid, which URDF
does not have, three cylinders along its z as wide as it is in the middle of each third (semi-axes a, b: sqrt(a b)).
"""

import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Iterator

import mujoco
import numpy as np

from mjcf.rpy import rpy_from_matrix

SEEN = 2
Text = Callable[[Iterable[float]], str]


def collisions(model: mujoco.MjModel, body_id: int, text: Text) -> Iterator[ET.Element]:
    """Collision elements of a body, numbers written by `text`."""
    first = int(model.body_geomadr[body_id])
    for geom_id in range(first, first + int(model.body_geomnum[body_id])):
        if model.geom_group[geom_id] != SEEN:
            continue
        R = np.empty(9)
        mujoco.mju_quat2Mat(R, model.geom_quat[geom_id])
        for shape, along_z in _shapes(int(model.geom_type[geom_id]), model.geom_size[geom_id], text):
            collision = ET.Element("collision")
            origin = model.geom_pos[geom_id] + along_z * R.reshape(3, 3)[:, 2]
            rpy = rpy_from_matrix(R.reshape(3, 3))
            ET.SubElement(collision, "origin", xyz=text(origin), rpy=text(rpy))
            ET.SubElement(collision, "geometry").append(shape)
            yield collision


def _shapes(kind: int, size: np.ndarray, text: Text) -> Iterator[tuple[ET.Element, float]]:
    """URDF shapes of a geom and how far along its z they stand [m]; other kinds have none."""
    of = mujoco.mjtGeom
    if kind == of.mjGEOM_BOX:
        yield ET.Element("box", size=text(2.0 * size)), 0.0
    elif kind == of.mjGEOM_SPHERE:
        yield ET.Element("sphere", radius=text(size[:1])), 0.0
    elif kind == of.mjGEOM_ELLIPSOID:
        wide, third = float(np.sqrt(size[0] * size[1])), 2.0 * float(size[2]) / 3.0
        for k in (-1, 0, 1):
            radius = wide * np.sqrt(1.0 - (2.0 * k / 3.0) ** 2)
            yield ET.Element("cylinder", radius=text([radius]), length=text([third])), k * third
    elif kind in (of.mjGEOM_CYLINDER, of.mjGEOM_CAPSULE):
        yield ET.Element("cylinder", radius=text(size[:1]), length=text([2.0 * size[1]])), 0.0
        if kind == of.mjGEOM_CAPSULE:
            for end in (-size[1], size[1]):
                yield ET.Element("sphere", radius=text(size[:1])), float(end)
