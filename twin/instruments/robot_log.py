"""The robot's own log: encoders on both sides, velocity, motor current, set-points."""

from dataclasses import dataclass

import numpy as np

from twin.config import TwinConfig
from twin.defects.sensing import Encoder
from twin.instruments.sampling import interpolate
from twin.motions import JOINTS
from twin.simulate import States


@dataclass(frozen=True)
class RobotLog:
    """Samples (n, 8) of every joint; see `calibration.recording.Trial` for the fields."""

    q_motor: np.ndarray
    q_link: np.ndarray
    v_motor: np.ndarray
    effort: np.ndarray
    q_command: np.ndarray


def measured(t: np.ndarray, states: States, encoders: tuple[Encoder, ...], config: TwinConfig) -> RobotLog:
    """The log at true times t (n,) [s from the first set-point]."""

    def sampled(values: np.ndarray) -> np.ndarray:
        return interpolate(t, states.t, values)

    per_ampere = np.array([config.torso.force_per_ampere, *(j.torque_per_ampere for j in config.arm.values())])
    quantum = config.instruments.current_quantum
    return RobotLog(
        q_motor=_read(sampled(states.motor), encoders, "motor"),
        q_link=_read(sampled(states.link), encoders, "link"),
        v_motor=sampled(states.motor_velocity),
        effort=np.round(sampled(states.torque) / per_ampere / quantum) * quantum,
        q_command=sampled(states.command),
    )


def _read(q: np.ndarray, encoders: tuple[Encoder, ...], side: str) -> np.ndarray:
    readings = np.full_like(q, np.nan)
    for encoder in encoders:
        if encoder.side == side:
            column = JOINTS.index(encoder.joint_name)
            readings[:, column] = encoder.read(q[:, column])
    return readings
