"""What the instruments say of a simulated trial, and what was true at their samples.

    shown by instrument i at true time t + latency_i:  (t + latency_i - offset_i) / (1 + drift_i)

The campaign's clock is the motion capture's: its stamps are true times of exposure plus its latency. So

    t_mocap = t_i (1 + drift_i) + offset_i + latency_mocap - latency_i
"""

from dataclasses import asdict, replace
from typing import Any

import mujoco
import numpy as np

from calibration.recording import Trial
from twin.campaign.laboratory import EPOCH, Laboratory
from twin.config.twin import RobotConfig
from twin.defects.defect import Defect
from twin.fields.names import BASE
from twin.instruments import force_plate, motion_capture, robot_log, wrist_sensor
from twin.instruments.clock import Clock, Latency
from twin.instruments.sampling import averaged, interpolate, interpolate_poses
from twin.motions.motion import Motion
from twin.motions.swings import JOINTS
from twin.random_streams import generator
from twin.simulation.force_plates import PLATE, PlateGrid, plate_sites
from twin.simulation.states import States
from twin.transforms import transform
from twin.truth import TruthTrial


def measure(lab: Laboratory, motion: Motion, states: States, start: float) -> tuple[Trial, TruthTrial]:
    """What the instruments say of a trial that starts at `start` [s], and what was true."""
    i, late = lab.config.instruments, lab.config.instruments.mocap.latency
    robot, force = clocks(lab.config)
    stop = start + float(states.t[-1])
    t_robot, true_robot = robot.ticks(start, stop, i.robot_rate)
    t_plate, true_plate = force.ticks(start, stop, i.plate_rate)
    t_mocap, _ = Clock("mocap").ticks(start + late, stop + late, i.mocap_rate)
    true = _true(lab, states, t_mocap, start)
    wrench = _wrist(lab, motion, states, true_robot - start)
    log = robot_log.measured(true_robot - start, states, lab.robot.encoders, _drives(lab.config), wrench)
    rng = generator(lab.seed, motion.id, "robot")
    plates: dict[str, Any] = (
        {}
        if motion.kinematic
        else {
            "plate": PlateGrid(i.plate_grid).names,
            "t_plate": t_plate,
            "plate_wrench": _wrenches(lab, motion, states, true_plate, start),
            "plate_centre": plate_centres(lab.twin.model),
        }
    )
    t_robot, log = robot_log.kept(robot_log.stamped(t_robot, i.robot_rate, i.log, rng), log, i.log, rng)
    return Trial(
        id=motion.id,
        joint=JOINTS,
        t_robot=t_robot,
        **asdict(log),
        marker=true.marker,
        marker_body=tuple(c.name for c in lab.robot.clusters for _ in c.marker_names),
        t_mocap=t_mocap,
        marker_position=_markers(lab, motion, states, true, start),
        **plates,
        dwell_start=motion.dwells[:, 0] + start + late,
        dwell_stop=motion.dwells[:, 1] + start + late,
        approach=motion.approach,
    ), true


def _drives(config: RobotConfig) -> robot_log.Drives:
    per_ampere = [config.torso.force_per_ampere, *(config.arm[j].torque_per_ampere for j in JOINTS[1:])]
    return robot_log.Drives(
        np.array(per_ampere), config.instruments.current_quantum, config.instruments.log.velocity_cutoff
    )


def clocks(config: RobotConfig) -> tuple[Clock, Clock]:
    """The robot's and the plate's, against true time; stamps of a log that is late are late."""
    i = config.instruments
    robot, force = i.robot_clock, i.plate_clock
    return Clock("robot", robot.offset - i.log.latency, robot.drift), Clock("plate", force.offset, force.drift)


def _wrist(lab: Laboratory, motion: Motion, states: States, t: np.ndarray) -> np.ndarray | None:
    """What the wrist's sensor reads (n, 6) at t (n,) [s from the first set-point], if there is one."""
    sensor, rate = lab.config.instruments.wrist, lab.config.instruments.robot_rate
    if sensor is None:
        return None
    worn = wrist_sensor.sample_wrist(sensor, generator(lab.seed, "wrist"))
    return wrist_sensor.measured(t, rate, states.t, states.wrist, worn, generator(lab.seed, motion.id, "wrist"))


def instrument_errors(lab: Laboratory) -> tuple[Defect | Clock | Latency, ...]:
    """Every constant of the instruments; the clocks against the motion capture's, latencies included."""
    i, (robot, force), worn = lab.config.instruments, clocks(lab.config), _plates(lab)
    late = i.mocap.latency
    robot, force = (
        replace(robot, offset=robot.offset + late),
        replace(force, offset=force.offset + late - worn[0].delay),
    )
    latencies = (Latency("mocap", late), Latency("robot", i.log.latency), Latency("plate", worn[0].delay))
    held = () if i.wrist is None else (wrist_sensor.sample_wrist(i.wrist, generator(lab.seed, "wrist")),)
    return robot, force, *(x for x in latencies if x.value), *worn, _volume(lab), *held


def plate_centre(model: mujoco.MjModel) -> np.ndarray:
    """Surface centre of the plate in the lab (3,) [m]."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return data.site(PLATE).xpos.copy()


def plate_centres(model: mujoco.MjModel) -> np.ndarray:
    """Surface centre of each plate in the lab (n_plates, 3) [m]."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return np.array([data.site(name).xpos for name in plate_sites(model) or (PLATE,)])


def plate_axes(model: mujoco.MjModel) -> np.ndarray:
    """R_lab_plate (3, 3), the same of all plates."""
    return np.asarray(transform(np.zeros(3), model.body(PLATE).quat)[:3, :3])


def _plates(lab: Laboratory) -> tuple[force_plate.PlateDefect, ...]:
    i = lab.config.instruments
    return tuple(
        force_plate.sample_plate(n, i.plate, generator(lab.seed, "plate", n)) for n in PlateGrid(i.plate_grid).names
    )


def _volume(lab: Laboratory) -> motion_capture.Volume:
    return motion_capture.volume(lab.config.instruments.mocap, generator(lab.seed, "volume"))


def _wrenches(lab: Laboratory, motion: Motion, states: States, true: np.ndarray, start: float) -> np.ndarray:
    """What the plates say (n, n_plates, 6), one after the other in the stream of their noise."""
    i = lab.config.instruments
    sigma = np.repeat([i.plate_force_noise, i.plate_moment_noise], 3)
    at = force_plate.Sampling(true, EPOCH, i.plate_rate, sigma, plate_axes(lab.twin.model))
    rng, t = generator(lab.seed, motion.id, "plate"), states.t + start
    each = zip(np.moveaxis(states.plates, 1, 0), _plates(lab), strict=True)
    return np.stack([force_plate.measured(at, t, wrench, worn, rng) for wrench, worn in each], axis=1)


def _markers(lab: Laboratory, motion: Motion, states: States, true: TruthTrial, start: float) -> np.ndarray:
    """Positions (n, m, 3) [m, lab], NaN where hidden."""
    i, body = lab.config.instruments, tuple(c.name for c in lab.robot.clusters for _ in c.marker_names)
    seen = _volume(lab).distorted(true.marker_position)
    seen = motion_capture.measured(seen, i.marker_noise, generator(lab.seed, motion.id, "mocap"))
    if i.mocap.cameras:
        t = true.t_mocap - i.mocap.latency - start
        arm = np.stack([interpolate(t, states.t, states.poses[link][:, :3, 3]) for link in motion_capture.ARM], axis=1)
        seen[motion_capture.hidden(true.marker_position, arm, i.mocap)] = np.nan
    return motion_capture.relabelled(true.t_mocap, seen, body, i.mocap, generator(lab.seed, motion.id, "labels"))


def _true(lab: Laboratory, states: States, t_mocap: np.ndarray, start: float) -> TruthTrial:
    """What was true when the frames stamped t_mocap were exposed."""
    exposed, clusters = t_mocap - lab.config.instruments.mocap.latency, lab.robot.clusters
    t = exposed - start
    poses = {name: interpolate_poses(t, states.t, T) for name, T in states.poses.items()}
    hand = next(c for c in clusters if c.name == "gripper")
    names = tuple(m for c in clusters for m in c.marker_names)
    markers = np.concatenate([motion_capture.marker_positions(poses[c.link], c) for c in clusters], axis=1)
    for marker in lab.robot.loose:
        markers = marker.moved(exposed - EPOCH, names, markers)
    return TruthTrial(
        joint=JOINTS,
        marker=names,
        t_mocap=t_mocap,
        q_motor_true=interpolate(t, states.t, states.motor),
        q_link_true=interpolate(t, states.t, states.link),
        base_pose=poses[BASE],
        hand_pose=poses[hand.link] @ hand.T_link_body,
        marker_position=markers,
        plate_wrench=averaged(t, states.t, states.wrench, 1.0 / lab.config.instruments.mocap_rate),
    )
