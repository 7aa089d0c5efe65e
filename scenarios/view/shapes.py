"""Shapes of a URDF's links as meshes: boxes, cylinders, capsules and spheres; mesh files are left out."""

from typing import cast
from xml.etree import ElementTree

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

_KINDS = ("visual", "collision")
_STILL = 1e-9  # [m, -] of relative motion


def meshes(urdf: str) -> dict[str, trimesh.Trimesh]:
    """A mesh in the link's frame for each link with a primitive, what is drawn before what collides."""
    found: dict[str, trimesh.Trimesh] = {}
    for link in ElementTree.fromstring(urdf).iter("link"):
        for kind in _KINDS:
            parts = [part for item in link.iter(kind) if (part := _part(item)) is not None]
            if parts:
                found[str(link.get("name"))] = _one(parts)
                break
    return found


def rigid_groups(T: dict[str, np.ndarray]) -> list[list[str]]:
    """Links that do not move against each other, by their poses (n, 4, 4)."""
    groups: list[list[str]] = []
    for link, poses in T.items():
        mine = (g for g in groups if np.ptp(np.linalg.inv(T[g[0]]) @ poses, axis=0).max() < _STILL)
        group = next(mine, None)
        if group is None:
            groups.append([link])
        else:
            group.append(link)
    return groups


def joined(shapes: dict[str, trimesh.Trimesh], T: dict[str, np.ndarray]) -> trimesh.Trimesh:
    """The meshes of links at their poses (4, 4) as one."""
    return _one([shapes[link].copy().apply_transform(pose) for link, pose in T.items()])


def _one(parts: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    return cast(trimesh.Trimesh, trimesh.util.concatenate(parts))


def _part(item: ElementTree.Element) -> trimesh.Trimesh | None:
    geometry = item.find("geometry")
    shape = None if geometry is None or not len(geometry) else _primitive(geometry[0])
    origin = item.find("origin")
    if shape is not None and origin is not None:
        T = np.eye(4)
        T[:3, 3] = _numbers(origin.get("xyz", "0 0 0"))
        T[:3, :3] = Rotation.from_euler("xyz", _numbers(origin.get("rpy", "0 0 0"))).as_matrix()
        shape.apply_transform(T)
    return shape


def _primitive(shape: ElementTree.Element) -> trimesh.Trimesh | None:
    if shape.tag == "box":
        return trimesh.creation.box(_numbers(shape.get("size", "0 0 0")))
    radius, length = float(shape.get("radius", 0.0)), float(shape.get("length", 0.0))
    if shape.tag == "sphere":
        return trimesh.creation.icosphere(subdivisions=2, radius=radius)
    if shape.tag == "cylinder":
        return trimesh.creation.cylinder(radius, length, sections=24)
    if shape.tag == "capsule":
        return trimesh.creation.capsule(length, radius, count=(16, 8))
    return None


def _numbers(text: str) -> list[float]:
    return [float(x) for x in text.split()]
