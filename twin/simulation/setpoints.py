"""From a trial to what a rollout takes: a model, a first state and the controls of every step.

Set-points arrive at the robot's rate and the drives interpolate them.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from twin.defects.gear import rotor_joint
from twin.defects.wheels.rolling_wheel import DRIVES, roll_joint
from twin.motions.driving import differential_drive
from twin.motions.motion import RATE, SETTLE, Motion
from twin.motions.swings import JOINTS
from twin.simulation.base_joint import place_base
from twin.simulation.build import PUSH, Twin


@dataclass(frozen=True)
class RolloutInputs:
    """A rollout of n steps, `SETTLE` seconds of rest before the trial's first set-point included.

    Attributes:
        model: The robot where it is put down.
        first: State (ns,) before the first step, MuJoCo's full physics.
        control: (n, nu).
        command: Interpolated set-points (n, 8) [m, rad].
        push: Force on the hand, its axes (n, 3) [N].
        settling: Steps before the first set-point.
    """

    model: mujoco.MjModel
    first: np.ndarray
    control: np.ndarray
    command: np.ndarray
    push: np.ndarray
    settling: int


def prepare(twin: Twin, motion: Motion, T_lab_base: np.ndarray) -> RolloutInputs:
    """What a rollout takes to simulate a trial, the robot upright at T_lab_base (4, 4)."""
    model, data = place_base(twin.model, T_lab_base)
    step = model.opt.timestep
    command = _interpolated(motion.command, step)
    control = np.zeros((len(command), model.nu))
    control[:, [model.actuator(driven(j)).id for j in JOINTS]] = command
    push = np.zeros((len(command), len(PUSH)))
    if motion.push is not None:
        push = _interpolated(motion.push, step)
        control[:, [model.actuator(name).id for name in PUSH]] = push
    if motion.base is not None:
        angles = _interpolated(motion.base.wheel_angles(*differential_drive()), step)
        control[:, [model.actuator(roll_joint(name)).id for name in DRIVES]] = angles
    settling = len(command) - round(motion.duration / step) - 1
    return RolloutInputs(model, _first_state(model, data, motion.command[0]), control, command, push, settling)


def driven(joint: str) -> str:
    """Joint that the drive of a joint turns: the motor side, where there is a gear."""
    return joint if joint == JOINTS[0] else rotor_joint(joint)


def _interpolated(setpoints: np.ndarray, timestep: float) -> np.ndarray:
    """Set-points at every step, from `SETTLE` seconds before the first."""
    n_settle, n = round(SETTLE / timestep), round((len(setpoints) - 1) / RATE / timestep)
    t = np.arange(-n_settle, n + 1) * timestep
    grid = np.arange(len(setpoints)) / RATE
    return np.stack([np.interp(t, grid, column) for column in setpoints.T], axis=1)


def _first_state(model: mujoco.MjModel, data: mujoco.MjData, q: np.ndarray) -> np.ndarray:
    for joint, value in zip(JOINTS, q, strict=True):
        data.joint(joint).qpos = value
        data.joint(driven(joint)).qpos = value
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    return state
