"""Simulation of one trial: set-points in, dense states out, one `mujoco.rollout`, no Python between the steps."""

import logging
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco import rollout

from twin import wrenches
from twin.build import Twin
from twin.conventions import states_with_their_sensors, transform
from twin.inputs import Inputs, driven, prepare
from twin.instruments.tiles import PLATE, felt
from twin.motions import JOINTS, Motion
from twin.root import anchored, floor_wrench
from twin.stability import check

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class States:
    """What was true, at every step of the simulation.

    Attributes:
        t: (n,) [s], 0 at the first set-point.
        motor: Motor-side angles (n, 8) [m, rad].
        link: Link-side angles (n, 8) [m, rad].
        motor_velocity: (n, 8) [m/s, rad/s].
        torque: Of the drives (n, 8) [N, N.m].
        command: Interpolated set-points (n, 8) [m, rad].
        poses: T_lab_link (n, 4, 4) by link.
        wrench: Action of the robot on the plate, lab axes, about the plate's centre (n, 6) [N, N.m].
        plates: Its parts on each plate, about that one's centre (n, n_plates, 6) [N, N.m].
        wrist: Action of the hand on the wrist's sensor, its axes, about its origin (n, 6) [N, N.m].
    """

    t: np.ndarray
    motor: np.ndarray
    link: np.ndarray
    motor_velocity: np.ndarray
    torque: np.ndarray
    command: np.ndarray
    poses: dict[str, np.ndarray]
    wrench: np.ndarray
    plates: np.ndarray
    wrist: np.ndarray


def simulate(twin: Twin, motion: Motion, T_lab_base: np.ndarray) -> States:
    """Simulate a trial from a settled stand.

    Args:
        twin: The robot.
        motion: Set-points; the robot rests `SETTLE` seconds in the first of them before time zero.
        T_lab_base: Where it is put down, upright (4, 4).

    Raises:
        Diverged: It is not stable.
        NotStanding: The robot tipped over or left its plate.
    """
    inputs = prepare(twin, motion, T_lab_base)
    model, first = inputs.model, inputs.first
    mujoco.set_mju_user_warning(_log.debug)  # or it writes MUJOCO_LOG.TXT where the user stands
    after, sensors = rollout.rollout(model, mujoco.MjData(model), first[None], inputs.control[None])
    states = states_with_their_sensors(first, after[0])
    check(inputs, motion, states)
    skip = inputs.settling
    return _unpack(inputs, twin.links, states[skip:], sensors[0][skip:])


def _unpack(inputs: Inputs, links: tuple[str, ...], states: np.ndarray, sensors: np.ndarray) -> States:
    model, command, push = inputs.model, inputs.command[inputs.settling :], inputs.push[inputs.settling :]
    qpos, qvel = states[:, 1 : 1 + model.nq], states[:, 1 + model.nq : 1 + model.nq + model.nv]
    link = np.stack([qpos[:, model.joint(j).qposadr[0]] for j in JOINTS], axis=1)
    motor = np.stack([qpos[:, model.joint(driven(j)).qposadr[0]] for j in JOINTS], axis=1)
    velocity = np.stack([qvel[:, model.joint(driven(j)).dofadr[0]] for j in JOINTS], axis=1)
    servos = [model.actuator(driven(j)).id for j in JOINTS]
    kp, kv = model.actuator_gainprm[servos, 0], -model.actuator_biasprm[servos, 2]
    wrench = _floor_wrench(model, qpos, qvel) if anchored(model) else wrenches.on_plate(model, sensors, PLATE)
    each = [wrenches.on_plate(model, sensors, tile) for tile in felt(model)] or [wrench]
    return States(
        t=np.arange(len(states)) * model.opt.timestep,
        motor=motor,
        link=link,
        motor_velocity=velocity,
        torque=kp * (command - motor) - kv * velocity,
        command=command,
        poses={name: _pose(model, sensors, name) for name in links},
        wrench=wrench,
        plates=np.stack(each, axis=1),
        wrist=wrenches.on_wrist(model, sensors, push),
    )


def _pose(model: mujoco.MjModel, sensors: np.ndarray, link: str) -> np.ndarray:
    kinds = (mujoco.mjtSensor.mjSENS_FRAMEPOS, mujoco.mjtSensor.mjSENS_FRAMEQUAT)
    return transform(*(wrenches.sensed(model, sensors, [f"{link}.{k.name}"]) for k in kinds))


def _floor_wrench(model: mujoco.MjModel, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return floor_wrench(model, qpos, qvel, data.site(PLATE).xpos)
