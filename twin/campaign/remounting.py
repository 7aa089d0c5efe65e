"""Another session with the same robot: base moved, markers remounted, encoders homed again.

Streams are named after the session, so that it changes nothing of the first one.
"""

from dataclasses import replace

import numpy as np

from twin.campaign.robot import Robot, mounted
from twin.config.twin import RobotConfig
from twin.instruments.encoder import Encoder
from twin.random_streams import generator
from twin.transforms import exp6
from twin.truth import Parameter

CONFIRMATION = "confirmation"


def remounted(config: RobotConfig, robot: Robot, seed: int, session: str = CONFIRMATION) -> Robot:
    """The robot with its markers remounted, none loose, and its motors homed again; link encoders are absolute."""

    def homed(encoder: Encoder) -> Encoder:
        if encoder.side != "motor" or encoder.prismatic:
            return encoder
        shift = config.session.encoder_zero * float(generator(seed, session, "zero", encoder.joint_name).normal())
        return replace(encoder, offset=encoder.offset + shift)

    clusters = mounted(config, seed, session)
    return replace(robot, encoders=tuple(homed(e) for e in robot.encoders), clusters=clusters, loose=())


def moved(config: RobotConfig, T_lab_base: np.ndarray, seed: int, session: str = CONFIRMATION) -> np.ndarray:
    """T_lab_base (4, 4) after the base was moved."""
    x, y, yaw = generator(seed, session, "base").uniform(-1.0, 1.0, size=3)
    T = T_lab_base @ exp6(np.array([0.0, 0.0, 0.0, 0.0, 0.0, config.session.base_rotation * yaw]))
    T[:2, 3] += config.session.base_translation * np.array([x, y])
    return T


def session_parameters(robot: Robot) -> tuple[Parameter, ...]:
    """What is true in the confirmation only, `confirmation.` before each name."""
    motor = (e for e in robot.encoders if e.side == "motor")
    found = (p for source in (*motor, *robot.clusters) for p in source.parameters())
    return tuple(p._replace(name=f"{CONFIRMATION}.{p.name}") for p in found)
