"""A base on wheels made from the printed equations themselves: no simulator, no noise unless asked for."""

from dataclasses import replace

import numpy as np
import pinocchio as pin

from calibration.numerics.signals import RATE
from calibration.prediction.base_pose import BaseInTrial
from calibration.recording.schema import Wheel
from calibration.recording.trial import Trial
from calibration.stages.suspension.base_response import BaseResponse, Forcing
from calibration.stages.suspension.rest_frame import rest_of
from tests.doubles import rigid_robot

WHEELS = tuple(
    Wheel(name=name, type=kind, centre=(x, y, z), contact=(x, y, 0.0))
    for name, kind, x, y, z in (
        ("wheel_right", "drive", 0.0, -0.2022, 0.0985),
        ("wheel_left", "drive", 0.0, 0.2022, 0.0985),
        ("caster_front_right", "caster", 0.1535, -0.102, 0.025),
        ("caster_front_left", "caster", 0.1535, 0.102, 0.025),
        ("caster_back_right", "caster", -0.1895, -0.102, 0.025),
        ("caster_back_left", "caster", -0.1895, 0.102, 0.025),
    )
)
T_LAB_BASE = rigid_robot.se3(np.array([0.9, 0.5, 0.0, 0.0, 0.0, -1.6]))


def values(rng: np.random.Generator) -> np.ndarray:
    """Stiffnesses and dampings of six wheels, (72,): kx ky kz krx kry krz of each, then their c."""
    k = np.array([8e3, 1e4, 1.5e5, 300.0, 300.0, 100.0])
    both = np.array([np.tile(k, 6), np.tile(0.012 * k, 6)])
    return (both * rng.uniform(0.5, 1.5, both.shape)).ravel()


def smooth(rng: np.random.Generator, seconds: float, scale: np.ndarray, fastest: float = 2.0) -> np.ndarray:
    """Random signals (n, 6) that begin and end in long rest, nothing faster than about `fastest` [Hz]."""
    n = int(seconds * RATE)
    t = np.arange(n) / RATE
    window = np.clip((t - 4.0) / 3.0, 0.0, 1.0) * np.clip((seconds - 4.0 - t) / 3.0, 0.0, 1.0)
    window = window**3 * (10.0 - 15.0 * window + 6.0 * window**2)
    f, phase = rng.uniform(0.1, fastest, (6, 8)), rng.uniform(0.0, 2.0 * np.pi, (6, 8))
    waves = np.sin(2.0 * np.pi * f * t[:, None, None] + phase).sum(axis=2)
    return np.asarray(scale * window[:, None] * waves)


def response(
    name: str, w: np.ndarray, x: np.ndarray, M: np.ndarray | None = None, G: np.ndarray | None = None
) -> BaseResponse:
    t, none = np.arange(len(w)) / RATE, np.zeros((6, 6))
    forcing = Forcing(t, w, np.zeros(6), none if M is None else M, none if G is None else G, np.eye(4))
    return BaseResponse(name, forcing, x, np.ones(len(w), dtype=bool), np.full(6, 1e-14))


def moved(trial: Trial, x: np.ndarray, t: np.ndarray) -> Trial:
    """The trial with its markers carried along by a base displaced by x (n, 6) at t (n,) [s, mocap clock]."""
    at = np.stack([np.interp(trial.t_mocap, t, column) for column in x.T], axis=1)
    position = trial.marker_position.copy()
    for k, x_k in enumerate(at):
        T = T_LAB_BASE @ pin.SE3(pin.exp3(x_k[3:]), x_k[:3]).homogeneous @ np.linalg.inv(T_LAB_BASE)
        position[k] = position[k] @ T[:3, :3].T + T[:3, 3]
    return replace(trial, marker_position=position)


def base_poses(suspension, lab, trial, source) -> np.ndarray:
    """T_lab_B (n, 4, 4) of the base's marker body at `t_mocap`; outside the wrench's recording it stays."""
    rest = rest_of(lab.lab.description, trial, lab.T_base_B)
    base = BaseInTrial(suspension, lab, trial, rest.T_lab_0 @ rest.T_0_B)
    return rest.poses(base.displacement(source, rest))
