"""Simulation of one trial: set-points in, dense states out, one `mujoco.rollout`, no Python between the steps."""

import logging
from threading import Lock

import mujoco
import numpy as np
from mujoco import rollout

from twin.motions.motion import Motion
from twin.motions.swings import JOINTS
from twin.simulation import wrist_sensor
from twin.simulation.base_joint import anchored, floor_wrench
from twin.simulation.build import Twin
from twin.simulation.checks import check
from twin.simulation.force_plates import PLATE, on_plate, plate_poses, plate_sites
from twin.simulation.setpoints import RolloutInputs, driven, prepare
from twin.simulation.states import States
from twin.transforms import states_with_their_sensors, transform

SENSOR = "instrument."  # begins the name of a sensor of an instrument of one's own
_log = logging.getLogger(__name__)
_setting = Lock()  # two threads that make MuJoCo's first call at once wait for each other for ever


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
    log_warnings()
    after, sensors = rollout.rollout(model, mujoco.MjData(model), first[None], inputs.control[None])
    states = states_with_their_sensors(first, after[0])
    check(inputs, motion, states)
    skip = inputs.settling
    return _unpack(inputs, twin.links, states[skip:], sensors[0][skip:])


def log_warnings() -> None:
    """Have MuJoCo's warnings in this module's log: it would write MUJOCO_LOG.TXT into the working folder."""
    with _setting:
        mujoco.set_mju_user_warning(_log.debug)


def _unpack(inputs: RolloutInputs, links: tuple[str, ...], states: np.ndarray, sensors: np.ndarray) -> States:
    model, command, push = inputs.model, inputs.command[inputs.settling :], inputs.push[inputs.settling :]
    qpos, qvel = states[:, 1 : 1 + model.nq], states[:, 1 + model.nq : 1 + model.nq + model.nv]
    link = np.stack([qpos[:, model.joint(j).qposadr[0]] for j in JOINTS], axis=1)
    motor = np.stack([qpos[:, model.joint(driven(j)).qposadr[0]] for j in JOINTS], axis=1)
    velocity = np.stack([qvel[:, model.joint(driven(j)).dofadr[0]] for j in JOINTS], axis=1)
    servos = [model.actuator(driven(j)).id for j in JOINTS]
    kp, kv = model.actuator_gainprm[servos, 0], -model.actuator_biasprm[servos, 2]
    wrench = _floor_wrench(model, qpos, qvel) if anchored(model) else on_plate(model, sensors, PLATE)
    each = [on_plate(model, sensors, tile) for tile in plate_sites(model)] or [wrench]
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
        T_lab_plates=plate_poses(model),
        wrist=wrist_sensor.on_wrist(model, sensors, push),
        sensors={n.removeprefix(SENSOR): wrist_sensor.sensed(model, sensors, [n]) for n in _of_instruments(model)},
    )


def _of_instruments(model: mujoco.MjModel) -> list[str]:
    return [name for i in range(model.nsensor) if (name := model.sensor(i).name).startswith(SENSOR)]


def _pose(model: mujoco.MjModel, sensors: np.ndarray, link: str) -> np.ndarray:
    kinds = (mujoco.mjtSensor.mjSENS_FRAMEPOS, mujoco.mjtSensor.mjSENS_FRAMEQUAT)
    return transform(*(wrist_sensor.sensed(model, sensors, [f"{link}.{k.name}"]) for k in kinds))


def _floor_wrench(model: mujoco.MjModel, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return floor_wrench(model, qpos, qvel, data.site(PLATE).xpos)
