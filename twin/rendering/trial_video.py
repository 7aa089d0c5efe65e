"""A clip of a recorded trial: the robot as it truly moved, its markers, and the force the plate bears.

    base     T_0 exp6(m log6(T_0^-1 T(t)))      its motion from the first sample on, m times as large
    ghost    the nominal robot at the motor readings, its base where it first stood, mixed into the picture
    arrow    the plate's reaction, from the centre of pressure (-My, Mx) / Fz, 0.7 mm a newton, drawn over the robot

Arm and torso are drawn at their true angles; the bending of links and wheels below the base is not recorded and not
drawn. A GIF runs at the speed of the recording.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy.spatial.transform import RigidTransform

import mjcf
from twin.campaign.laboratory_model import Laboratory
from twin.errors import TwinError
from twin.rendering.raycaster import View
from twin.rendering.renderer import Frames, Renderer
from twin.rendering.robot_image import portrait, with_markers
from twin.simulation.base_joint import place_base
from twin.simulation.build import build
from twin.truth import TruthTrial

_METRES_PER_NEWTON = 0.7e-3
_LEAST = 50.0  # [N] of load without which there is no centre of pressure
_FORCE = (20, 96, 190)


class NothingToShow(TwinError):
    """A clip of no time."""


@dataclass(frozen=True)
class ClipOptions:
    """How a clip is made.

    Attributes:
        magnify: m, how many times as large the base's motion is drawn [-].
        start: From the trial's first sample [s].
        duration: [s]; 0: one picture.
        rate: Pictures a second [Hz].
        size: Width and height [pixel].
        renderer: `auto`, `egl` or `rays`.
        ghost: Share of the nominal robot in the picture [-].
    """

    magnify: float = 1.0
    start: float = 0.0
    duration: float = 10.0
    rate: float = 10.0
    size: tuple[int, int] = (480, 373)
    renderer: Renderer = "auto"
    ghost: float = 0.0


def clip(
    lab: Laboratory,
    trial: TruthTrial,
    path: Path,
    options: ClipOptions,
    progress: Callable[[float], None] = lambda _: None,
) -> int:
    """Write a GIF of a trial, or a PNG of one instant; return the number of pictures.

    Args:
        lab: The robot of the trial's session.
        trial: What was true in it.
        path: The file: a GIF, or a PNG where the duration is 0.
        options: How.
        progress: Called with the share of the pictures that is drawn.

    Raises:
        NothingToShow: The trial has no sample in the time asked for.
        NoGraphics: A driver was asked for and there is none.
    """
    shown = _samples(trial, options)
    model = build(with_markers(lab), lab.robot.defects, timestep=lab.config.timestep, visual=True).model
    view = portrait(mjcf.model(), trial.base_pose[0], options.size)
    model.vis.global_.fovy = np.degrees(view.field)
    model, data = place_base(model, trial.base_pose[0])
    mujoco.mj_kinematics(model, data)
    centre = data.site("plate").xpos.copy()
    poses = magnified(trial.base_pose, options.magnify)
    q = trial.q_link_true
    with Frames(model, view, options.renderer) as frames:
        part = 0.5 if options.ghost else 1.0
        images = []
        for i, k in enumerate(shown):
            images.append(frames.draw(posed(model, poses[k], trial.joint, q[k])))
            progress(part * (i + 1) / len(shown))
    if options.ghost:
        images = _with_ghosts(images, view, trial, shown, options)
    pictures = [annotated(image, view, trial, int(k), centre, options) for image, k in zip(images, shown, strict=True)]
    path.parent.mkdir(parents=True, exist_ok=True)
    if options.duration == 0.0:
        pictures[0].save(path, format="png", optimize=True)
        return 1
    palette = [p.quantize(128, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE) for p in pictures]
    pause = round(1000.0 / options.rate)
    palette[0].save(path, format="gif", save_all=True, append_images=palette[1:], duration=pause, loop=0)
    return len(pictures)


def _samples(trial: TruthTrial, options: ClipOptions) -> np.ndarray:
    t = trial.t_mocap - trial.t_mocap[0]
    wanted = options.start + np.arange(max(1, round(options.duration * options.rate))) / options.rate
    wanted = wanted[wanted <= t[-1]]
    if not len(wanted):
        raise NothingToShow(f"the trial lasts {t[-1]:.1f} s; there is nothing from {options.start:g} s on")
    return np.searchsorted(t, wanted)


def magnified(T: np.ndarray, m: float) -> np.ndarray:
    """Poses (n, 4, 4) with their motion since the first one m times as large."""
    first = RigidTransform.from_matrix(T[0])
    motion = (first.inv() * RigidTransform.from_matrix(T)).as_exp_coords()
    return np.asarray((first * RigidTransform.from_exp_coords(m * motion)).as_matrix())


def _with_ghosts(
    images: list[np.ndarray], view: View, trial: TruthTrial, shown: np.ndarray, options: ClipOptions
) -> list[np.ndarray]:
    """The pictures with the nominal robot mixed in: the two differ where the robots do."""
    model = build(mjcf.spec(), (), visual=True).model
    model.vis.global_.fovy = np.degrees(view.field)
    still, q, part = trial.base_pose[0], trial.q_motor_true, options.ghost
    with Frames(model, view, options.renderer) as frames:
        ghosts = [frames.draw(posed(model, still, trial.joint, q[k])) for k in shown]
    mixed = (np.rint((1.0 - part) * a + part * b) for a, b in zip(images, ghosts, strict=True))
    return [image.astype(np.uint8) for image in mixed]


def posed(model: mujoco.MjModel, T_lab_base: np.ndarray, joints: Sequence[str], q: np.ndarray) -> mujoco.MjData:
    """The state with the base at T_lab_base (4, 4) and the joints at q [rad, m]."""
    stood, data = place_base(model, T_lab_base)
    model.body_pos[:], model.body_quat[:] = stood.body_pos, stood.body_quat
    for joint, value in zip(joints, q, strict=True):
        data.joint(joint).qpos = value
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    return data


def annotated(
    image: np.ndarray, view: View, trial: TruthTrial, k: int, centre: np.ndarray, options: ClipOptions
) -> Image.Image:
    """The picture of sample k with the plate's reaction drawn over it, and what it shows in a line."""
    drawn = Image.fromarray(image)
    pen = ImageDraw.Draw(drawn)
    arrow = reaction(trial.plate_wrench[k], centre)
    if arrow is not None:
        _draw_arrow(pen, projected(view, arrow))
    caption = f"{trial.t_mocap[k] - trial.t_mocap[0]:5.1f} s   plate {-trial.plate_wrench[k, 2]:.0f} N"
    if options.magnify != 1.0:
        caption += f"   base's motion x {options.magnify:g}"
    if options.ghost:
        caption += "   pale: nominal"
    pen.text((8, view.size[1] - 22), caption, fill=(60, 66, 74), font=ImageFont.load_default(14))
    return drawn


def reaction(wrench: np.ndarray, centre: np.ndarray) -> np.ndarray | None:
    """Foot and head (2, 3) [m, lab] of the reaction to a wrench (6,) about the plate's centre (3,), if loaded."""
    force, moment = wrench[:3], wrench[3:]
    if -force[2] < _LEAST:
        return None
    foot = centre + [-moment[1] / force[2], moment[0] / force[2], 0.0]
    return np.array([foot, foot - _METRES_PER_NEWTON * force])


def projected(view: View, points: np.ndarray) -> np.ndarray:
    """Image points (n, 2) [pixel] of points (n, 3) [m, lab]."""
    width, height = view.size
    focal = 0.5 * height / np.tan(0.5 * view.field)
    p = (points - view.T_lab_camera[:3, 3]) @ view.T_lab_camera[:3, :3]
    return np.stack([0.5 * width + focal * p[:, 0] / -p[:, 2], 0.5 * height - focal * p[:, 1] / -p[:, 2]], axis=1)


def _draw_arrow(pen: ImageDraw.ImageDraw, ends: np.ndarray) -> None:
    foot, head = ends
    along = (head - foot) / max(float(np.linalg.norm(head - foot)), 1e-9)
    across = np.array([-along[1], along[0]])
    neck = head - 14.0 * along
    pen.line([tuple(foot), tuple(neck)], fill=_FORCE, width=4)
    pen.polygon([tuple(head), tuple(neck + 6.0 * across), tuple(neck - 6.0 * across)], fill=_FORCE)
    pen.ellipse([*(foot - 4.0), *(foot + 4.0)], fill=_FORCE)
