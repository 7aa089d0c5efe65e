"""One robot in its laboratory."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

import mjcf
from twin.campaign.remounting import moved, remounted
from twin.campaign.robot import Robot, links_seen, sample
from twin.config.twin import SampledConfig, TwinConfig, sampled_config
from twin.defects.defect import Defect
from twin.fields.names import TORSO
from twin.instruments.clock import Clock
from twin.instruments.force_plate import ForcePlates, sample_plate
from twin.instruments.instrument import Instrument
from twin.instruments.motion_capture import MotionCapture
from twin.instruments.motion_capture import volume as calibrated_volume
from twin.instruments.robot_log import RobotLog
from twin.instruments.wrist_sensor import sample_wrist
from twin.motions.motion import Motion
from twin.random_streams import generator
from twin.simulation.build import Twin, build
from twin.simulation.force_plates import PlateGrid
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

    @cached_property
    def motion_capture(self) -> MotionCapture:
        """The motion capture, its volume calibrated."""
        i = self.config.instruments
        volume = calibrated_volume(i.mocap, generator(self.seed, "volume"))
        return MotionCapture(self.robot.clusters, self.robot.loose, volume, i.mocap, i.marker_noise, i.mocap_rate)

    @cached_property
    def instruments(self) -> tuple[Instrument, ...]:
        """Every instrument, sampled from streams of their own names."""
        i, late = self.config.instruments, self.config.instruments.mocap.latency
        per_ampere = {TORSO: self.config.torso.force_per_ampere}
        per_ampere |= {name: joint.torque_per_ampere for name, joint in self.config.arm.items()}
        wrist = None if i.wrist is None else sample_wrist(i.wrist, generator(self.seed, "wrist"))
        clock, plate_clock = (
            Clock(n, c.offset, c.drift) for n, c in (("robot", i.robot_clock), ("plate", i.plate_clock))
        )
        names, sigma = PlateGrid(i.plate_grid).names, np.repeat([i.plate_force_noise, i.plate_moment_noise], 3)
        plates = tuple(sample_plate(n, i.plate, generator(self.seed, "plate", n)) for n in names)
        return (
            RobotLog(self.robot.encoders, per_ampere, i.current_quantum, i.log, clock, i.robot_rate, wrist, late),
            ForcePlates(plates, sigma, plate_clock, i.plate_rate, late),
            self.motion_capture,
            *(x.sample(generator(self.seed, "instrument", str(k))) for k, x in enumerate(i.further)),
        )

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
    spec = mjcf.spec()
    for instrument in config.instruments.further:
        instrument.sense(spec)
    twin = build(spec, defects, links, config.timestep)
    check_meshes(twin.model, config.arm)
    return twin
