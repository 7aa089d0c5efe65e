"""The picture of a twin on its force plate, with its markers and its payload."""

from pathlib import Path

import mujoco
import numpy as np
from PIL import Image

import mjcf
from twin.campaign.laboratory_model import Laboratory, laboratory
from twin.config.twin import TwinConfig
from twin.motions.swings import JOINTS
from twin.rendering.raycaster import View, render
from twin.simulation.base_joint import place_base
from twin.simulation.build import build
from twin.transforms import transform

SIZE = (900, 700)
_MARKER = (0.90, 0.13, 0.20, 1.0)
_BACK = np.array([-0.02, -0.08, 0.06])  # [m] from the portrait, so that plate and payload are in the picture
_RADIUS = 0.012  # [m] of a drawn marker


def picture(config: TwinConfig, seed: int, path: Path, size: tuple[int, int] = SIZE) -> None:
    """Draw the robot of a seed, its arm held out in front, where its campaign puts it down.

    Needs neither a screen nor a graphics driver. The same robot gives the same bytes.

    Args:
        config: Robot and laboratory.
        seed: Root of every random stream.
        path: PNG file to write; its folder is made if there is none.
        size: Width and height [pixel].
    """
    lab, nominal = laboratory(config, seed), mjcf.model()
    model = build(with_markers(lab), lab.robot.defects, timestep=config.timestep, visual=True).model
    model, data = place_base(model, lab.T_lab_base)
    held_out = nominal.key("reach").qpos
    for joint in JOINTS:
        data.joint(joint).qpos = held_out[nominal.joint(joint).qposadr[0]]
    mujoco.mj_kinematics(model, data)
    image = render(model, data, portrait(nominal, lab.T_lab_base, size))
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(image).save(path, optimize=True)


def with_markers(lab: Laboratory) -> mujoco.MjSpec:
    """The nominal robot with a sphere at every marker's true place on its link."""
    spec = mjcf.spec()
    for cluster in lab.robot.clusters:
        T = cluster.T_link_body
        for place in (cluster.nominal + cluster.shift) @ T[:3, :3].T + T[:3, 3]:
            marker = spec.body(cluster.link).add_geom(
                type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[_RADIUS, 0.0, 0.0], pos=place, rgba=_MARKER, mass=0.0, group=2
            )
            marker.contype, marker.conaffinity = 0, 0
    return spec


def portrait(nominal: mujoco.MjModel, T_lab_base: np.ndarray, size: tuple[int, int]) -> View:
    """The scene's portrait, turned with the robot."""
    camera, root = nominal.camera("portrait"), nominal.key("reach").qpos[:7]
    T = T_lab_base @ np.linalg.inv(transform(root[:3], root[3:]))
    T_camera = np.eye(4)
    T_camera[:3, :3] = nominal.cam_mat0[camera.id].reshape(3, 3)
    T_camera[:3, 3] = nominal.cam_pos[camera.id] + T_camera[:3, :3] @ _BACK
    lamp = T[:3, :3] @ nominal.light("key").pos + T[:3, 3]
    return View(T @ T_camera, float(np.radians(camera.fovy[0])), lamp, size)
