"""One robot in its laboratory."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

import mjcf
from twin.campaign.robot import Robot, links_seen, sample
from twin.campaign.second_session import moved, remounted
from twin.config.twin import SampledConfig, TwinConfig, sampled_config
from twin.defects.defect import Defect
from twin.motions.motion import Motion
from twin.simulation.build import Twin, build
from twin.simulation.gear_limits import check_meshes
from twin.simulation.kinematic import kinematic_states
from twin.simulation.rollout import simulate
from twin.simulation.states import States
from twin.transforms import exp6

EPOCH = 100.0  # [s] on the mocap clock when the first trial starts


@dataclass(frozen=True)
class Laboratory:
    """One robot in its laboratory.

    Attributes:
        config: The true values of this robot and its instruments.
        seed: Root of every random stream.
        robot: The robot.
        twin: Its model.
        T_lab_base: Where it is put down (4, 4).
    """

    config: SampledConfig
    seed: int
    robot: Robot
    twin: Twin
    T_lab_base: np.ndarray

    def with_defects(self, *defects: Defect) -> "Laboratory":
        """The laboratory with the robot changed; see `Robot.with_defects`."""
        robot = self.robot.with_defects(*defects)
        return replace(self, robot=robot, twin=built(self.config, robot.defects, self.twin.links))

    def twin_in(self, motion: Motion, time: float) -> Twin:
        """The robot, its payload and temperature in a trial whose middle is `time` [s] after the campaign's start."""
        defects = tuple(d.at(motion, time) for d in self.robot.defects)
        if all(a is b for a, b in zip(defects, self.robot.defects, strict=True)):
            return self.twin
        return built(self.config, defects, self.twin.links)

    def states(self, motion: Motion, time: float = 0.0) -> States:
        """What a motion does to the robot at `time` [s] of the campaign; see `twin.simulate`."""
        move = kinematic_states if motion.kinematic else simulate
        return move(self.twin_in(motion, time), motion, self.T_lab_base)


def laboratory(nominal: TwinConfig, seed: int) -> Laboratory:
    """The robot of a seed on its plate."""
    config = sampled_config(nominal, seed)
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


def built(config: SampledConfig, defects: Sequence[Defect], links: Sequence[str]) -> Twin:
    """Build the robot with these defects and check that its gear stiffness suits the time step."""
    twin = build(mjcf.spec(), defects, links, config.timestep)
    check_meshes(twin.model, config.arm)
    return twin
