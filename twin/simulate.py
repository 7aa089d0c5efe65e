"""Simulation of one trial: set-points in, dense states out, no Python between the steps.

Set-points arrive at the robot's rate and the drives interpolate them; the simulation runs as one `mujoco.rollout`.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco import rollout

from twin.build import PUSH, Twin
from twin.conventions import states_with_their_sensors, transform
from twin.defects.gear import rotor_joint
from twin.defects.rolling import DRIVES, roll_joint
from twin.driving import differential_drive
from twin.errors import Diverged, NotStanding
from twin.motions import JOINTS, RATE, SETTLE, Motion
from twin.root import anchored, base_poses, floor_wrench, put_down

_MIN_UPRIGHT = 0.98  # [-] cosine of the base's tilt below which the robot has tipped


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
    """

    t: np.ndarray
    motor: np.ndarray
    link: np.ndarray
    motor_velocity: np.ndarray
    torque: np.ndarray
    command: np.ndarray
    poses: dict[str, np.ndarray]
    wrench: np.ndarray


def simulate(twin: Twin, motion: Motion, T_lab_base: np.ndarray) -> States:
    """Simulate a trial from a settled stand.

    Args:
        twin: The robot.
        motion: Set-points; the robot rests `SETTLE` seconds in the first of them before time zero.
        T_lab_base: Where it is put down, upright (4, 4).

    Raises:
        Diverged: A state is not finite.
        NotStanding: The robot tipped over.
    """
    model, data = put_down(twin.model, T_lab_base)
    command = _interpolated(motion.command, model.opt.timestep)
    control = _controls(model, command)
    if motion.push is not None:
        control[:, [model.actuator(name).id for name in PUSH]] = _interpolated(motion.push, model.opt.timestep)
    if motion.base is not None:
        angles = _interpolated(motion.base.wheel_angles(*differential_drive()), model.opt.timestep)
        control[:, [model.actuator(roll_joint(name)).id for name in DRIVES]] = angles
    first = _initial_state(model, data, motion.command[0])
    states, sensors = rollout.rollout(model, data, first[None], control[None])
    states = states_with_their_sensors(first, states[0])
    _check(model, motion, states)
    skip = len(command) - round(motion.duration / model.opt.timestep) - 1
    return _unpack(model, twin.links, states[skip:], sensors[0][skip:], command[skip:])


def _interpolated(setpoints: np.ndarray, timestep: float) -> np.ndarray:
    """Set-points at every step, from `SETTLE` seconds before the first."""
    n_settle, n = round(SETTLE / timestep), round((len(setpoints) - 1) / RATE / timestep)
    t = np.arange(-n_settle, n + 1) * timestep
    grid = np.arange(len(setpoints)) / RATE
    return np.stack([np.interp(t, grid, column) for column in setpoints.T], axis=1)


def _driven(joint: str) -> str:
    return joint if joint == JOINTS[0] else rotor_joint(joint)


def _controls(model: mujoco.MjModel, command: np.ndarray) -> np.ndarray:
    control = np.zeros((len(command), model.nu))
    for column, joint in enumerate(JOINTS):
        control[:, model.actuator(_driven(joint)).id] = command[:, column]
    return control


def _initial_state(model: mujoco.MjModel, data: mujoco.MjData, q: np.ndarray) -> np.ndarray:
    for joint, value in zip(JOINTS, q, strict=True):
        data.joint(joint).qpos = value
        data.joint(_driven(joint)).qpos = value
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    return state


def _check(model: mujoco.MjModel, motion: Motion, states: np.ndarray) -> None:
    bad = np.argwhere(~np.isfinite(states))
    if len(bad):
        step, column = bad[0]
        raise Diverged(motion.id, step * model.opt.timestep - SETTLE, _owner(model, int(column)))
    upright = base_poses(model, states[:, 1 : 1 + model.nq])[:, 2, 2]
    if upright.min() < _MIN_UPRIGHT:
        at = int(np.argmin(upright >= _MIN_UPRIGHT))
        raise NotStanding(f"trial {motion.id!r}: the robot tips over at {at * model.opt.timestep - SETTLE:.2f} s")


def _owner(model: mujoco.MjModel, column: int) -> str:
    """Joint that owns a column of the state (time, qpos, qvel)."""
    if 1 <= column <= model.nq:
        return model.joint(int(np.searchsorted(model.jnt_qposadr, column - 1, side="right")) - 1).name
    return model.joint(model.dof_jntid[min(max(column - 1 - model.nq, 0), model.nv - 1)]).name


def _unpack(
    model: mujoco.MjModel, links: tuple[str, ...], states: np.ndarray, sensors: np.ndarray, command: np.ndarray
) -> States:
    qpos, qvel = states[:, 1 : 1 + model.nq], states[:, 1 + model.nq : 1 + model.nq + model.nv]
    link = np.stack([qpos[:, model.joint(j).qposadr[0]] for j in JOINTS], axis=1)
    motor = np.stack([qpos[:, model.joint(_driven(j)).qposadr[0]] for j in JOINTS], axis=1)
    velocity = np.stack([qvel[:, model.joint(_driven(j)).dofadr[0]] for j in JOINTS], axis=1)
    servos = [model.actuator(_driven(j)).id for j in JOINTS]
    kp, kv = model.actuator_gainprm[servos, 0], -model.actuator_biasprm[servos, 2]
    return States(
        t=np.arange(len(states)) * model.opt.timestep,
        motor=motor,
        link=link,
        motor_velocity=velocity,
        torque=kp * (command - motor) - kv * velocity,
        command=command,
        poses={name: _pose(model, sensors, name) for name in links},
        wrench=_floor_wrench(model, qpos, qvel) if anchored(model) else _wrench(model, sensors),
    )


def _sensed(model: mujoco.MjModel, sensors: np.ndarray, name: str) -> np.ndarray:
    sensor = model.sensor(name)
    return sensors[:, sensor.adr[0] : sensor.adr[0] + sensor.dim[0]]


def _pose(model: mujoco.MjModel, sensors: np.ndarray, link: str) -> np.ndarray:
    kinds = (mujoco.mjtSensor.mjSENS_FRAMEPOS, mujoco.mjtSensor.mjSENS_FRAMEQUAT)
    return transform(*(_sensed(model, sensors, f"{link}.{k.name}") for k in kinds))


def _floor_wrench(model: mujoco.MjModel, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return floor_wrench(model, qpos, qvel, data.site("plate").xpos)


def _wrench(model: mujoco.MjModel, sensors: np.ndarray) -> np.ndarray:
    """Action on the plate: the site's sensors give what holds the plate up, less its own weight."""
    kinds = (mujoco.mjtSensor.mjSENS_FORCE, mujoco.mjtSensor.mjSENS_TORQUE)
    support = np.concatenate([_sensed(model, sensors, f"plate.{k.name}") for k in kinds], axis=1)
    plate = model.body(model.site("plate").bodyid[0])
    weight = plate.mass[0] * model.opt.gravity
    lever = plate.ipos - model.site("plate").pos
    return -support - np.concatenate([weight, np.cross(lever, weight)])
