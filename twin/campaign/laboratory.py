"""One robot in its laboratory."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

import mjcf
from twin.campaign.robot import Robot, links_seen, sample
from twin.campaign.second_session import moved, remounted
from twin.config.distributions import sampled
from twin.config.twin import TwinConfig
from twin.defects.defect import Defect
from twin.simulation.build import Twin, build
from twin.simulation.gear_limits import check_meshes
from twin.transforms import exp6

EPOCH = 100.0  # [s] on the mocap clock when the first trial starts


@dataclass(frozen=True)
class Laboratory:
    """One robot in its laboratory.

    Attributes:
        config: What the scenario says, its uncertain values drawn.
        seed: Root of every random stream.
        robot: The drawn robot.
        twin: Its model.
        T_lab_base: Where it is put down (4, 4).
    """

    config: TwinConfig
    seed: int
    robot: Robot
    twin: Twin
    T_lab_base: np.ndarray


def laboratory(config: TwinConfig, seed: int) -> Laboratory:
    """Draw a robot and put it on its plate."""
    config = sampled(config, seed)
    robot = sample(config, seed)
    twin = built(config, robot.defects, links_seen(config, robot))
    x, y, yaw = config.base.pose
    T_lab_base = exp6(np.array([0.0, 0.0, 0.0, 0.0, 0.0, yaw]))
    T_lab_base[:3, 3] = x, y, config.instruments.plate_place.height
    return Laboratory(config, seed, robot, twin, T_lab_base)


def second_session(lab: Laboratory) -> Laboratory:
    """The same robot on another day."""
    robot = remounted(lab.config, lab.robot, lab.seed)
    return replace(lab, robot=robot, T_lab_base=moved(lab.config, lab.T_lab_base, lab.seed))


def built(config: TwinConfig, defects: Sequence[Defect], links: Sequence[str]) -> Twin:
    """Build the robot with these defects and check that its gear stiffness suits the time step."""
    twin = build(mjcf.spec(), defects, links, config.timestep)
    check_meshes(twin.model, config.arm)
    return twin
