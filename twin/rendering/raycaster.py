"""A picture of a model without a graphics driver: MuJoCo's own ray casting, shaded in numpy.

    colour = albedo (ambient + a n.up - b n.right + lamp max(0, n.l))        n normal, l towards the lamp if it is seen

Far ground fades into the background. Pixels at an edge are cast again four times. The same model gives the same
picture on any machine, with or without a screen.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

_GROUPS = np.array([1, 1, 1, 0, 0, 0], dtype=np.uint8)  # what a viewer shows: not collision shapes, not sites
_BACKGROUND = np.array([0.965, 0.972, 0.980])
_TILES = np.array([[0.80, 0.81, 0.83], [0.85, 0.86, 0.88]])
_TILE = 0.5  # [m]
_FADE = (3.0, 9.0)  # [m] distances at which the ground starts and ends to fade
_CLEAR = 2e-3  # [m] what a shadow starts behind
_EDGE = 0.06  # [-] smallest step of colour that is cast again
_SUBPIXELS = np.array([[-0.375, -0.125], [0.125, -0.375], [0.375, 0.125], [-0.125, 0.375]])


@dataclass(frozen=True)
class View:
    """Where the picture is taken from, and what lights it.

    Attributes:
        T_lab_camera: Looks along -z, y up (4, 4).
        field: Vertical field of view [rad].
        lamp: Where the lamp is (3,) [m].
        size: Width and height [pixel].
    """

    T_lab_camera: np.ndarray
    field: float
    lamp: np.ndarray
    size: tuple[int, int]


def render(model: mujoco.MjModel, data: mujoco.MjData, view: View) -> np.ndarray:
    """Cast the picture of a state whose kinematics are computed: (height, width, 3) uint8."""
    width, height = view.size
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2) + 0.5
    image = _colours(model, data, view, pixels)
    edges = np.flatnonzero(_edges(image.reshape(height, width, 3)).ravel())
    again = (pixels[edges, None] + _SUBPIXELS).reshape(-1, 2)
    image[edges] = _colours(model, data, view, again).reshape(len(edges), -1, 3).mean(axis=1)
    return np.round(255.0 * image.clip(0.0, 1.0)).astype(np.uint8).reshape(height, width, 3)


def _edges(image: np.ndarray) -> np.ndarray:
    """Pixels (height, width) that differ from a neighbour."""
    edge = np.zeros(image.shape[:2], dtype=bool)
    down = np.abs(np.diff(image, axis=0)).max(axis=2) > _EDGE
    right = np.abs(np.diff(image, axis=1)).max(axis=2) > _EDGE
    edge[1:] |= down
    edge[:-1] |= down
    edge[:, 1:] |= right
    edge[:, :-1] |= right
    return edge


def _colours(model: mujoco.MjModel, data: mujoco.MjData, view: View, pixels: np.ndarray) -> np.ndarray:
    """Colours (n, 3) seen through image points (n, 2) [pixel]."""
    width, height = view.size
    focal = 0.5 * height / np.tan(0.5 * view.field)
    u, v = (pixels[:, 0] - 0.5 * width) / focal, (0.5 * height - pixels[:, 1]) / focal
    rays = np.stack([u, v, -np.ones_like(u)], axis=1) @ view.T_lab_camera[:3, :3].T
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    eye = view.T_lab_camera[:3, 3]
    geom, distance, normal = _cast(model, data, eye, rays)
    hit = (geom >= 0) & (distance < _FADE[1])
    colour = np.tile(_BACKGROUND, (len(rays), 1))
    points = eye + distance[hit, None] * rays[hit]
    albedo, light = _albedo(model, geom[hit], points), _light(model, data, view, points, normal[hit])
    ground = model.geom_type[geom[hit]] == mujoco.mjtGeom.mjGEOM_PLANE
    fade = np.where(ground, np.interp(distance[hit], _FADE, (0.0, 1.0)), 0.0)[:, None]
    colour[hit] = (1.0 - fade) * albedo * light[:, None] + fade * _BACKGROUND
    return colour


def _cast(
    model: mujoco.MjModel, data: mujoco.MjData, origin: np.ndarray, rays: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First geom hit (n,), -1 for none, its distance (n,) [m] and normal (n, 3), of unit rays (n, 3)."""
    n = len(rays)
    geom, distance, normal = np.full(n, -1, dtype=np.int32), np.zeros(n), np.zeros(3 * n)
    mujoco.mj_multiRay(model, data, origin, rays.ravel(), _GROUPS, True, -1, geom, distance, normal, n, mujoco.mjMAXVAL)
    return geom, distance, normal.reshape(n, 3)


def _albedo(model: mujoco.MjModel, geom: np.ndarray, points: np.ndarray) -> np.ndarray:
    painted, colours = model.geom_matid >= 0, model.geom_rgba[:, :3].copy()
    colours[painted] = model.mat_rgba[model.geom_matid[painted], :3]
    colour = colours[geom]
    ground = model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE
    tiles = np.floor(points[ground, :2] / _TILE).astype(int).sum(axis=1) % 2
    colour[ground] = _TILES[tiles]
    return colour


def _light(
    model: mujoco.MjModel, data: mujoco.MjData, view: View, points: np.ndarray, normal: np.ndarray
) -> np.ndarray:
    """Light (n,) that falls on points (n, 3) with normals (n, 3)."""
    ray = points - view.lamp
    length = np.linalg.norm(ray, axis=1)
    ray /= length[:, None]
    facing = np.maximum(-(ray * normal).sum(axis=1), 0.0)
    turned = np.flatnonzero(facing > 0.0)
    _, first, _ = _cast(model, data, view.lamp, ray[turned])
    facing[turned[first < length[turned] - _CLEAR]] = 0.0
    side = view.T_lab_camera[:3, 0]
    return 0.47 + 0.17 * normal[:, 2] - 0.09 * normal @ side + 0.50 * facing
