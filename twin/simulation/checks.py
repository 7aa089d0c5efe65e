"""What makes a simulated trial unusable: numbers that run away, a base that vibrates, tips over or leaves its plate.

A base at rest vibrates where its acceleration changes from step to step, rms of (v[k+1] - 2 v[k] + v[k-1]) / h. Sound
ones change it by 5e-6 to 2e-4 m/s2, where gears with friction still ring by 0.013 m/s2 and 0.09 rad/s2 at most;
solvers that overshoot by 0.45 m/s2 and up.
MuJoCo resets a simulation that runs away to the model's first posture, with finite numbers; its clock shows it.
"""

import mujoco
import numpy as np

from twin.errors import BaseVibrates, Diverged, RobotFell
from twin.motions.motion import SETTLE, Motion
from twin.simulation.base_joint import ROOT, base_poses, base_velocities
from twin.simulation.force_plates import plate_sites
from twin.simulation.setpoints import RolloutInputs

_FAST = 100.0  # [m/s, rad/s] nothing of this robot moves like that
_MIN_UPRIGHT = 0.98  # [-] cosine of the base's tilt below which the robot has tipped
_SEAM = 0.01  # [m] a wheel nearer to a seam may touch both plates
_EVERY = 10  # steps: who tips over or leaves the plate is still there after them
_STILL = 0.25  # [s] before the motion begins, in which the base rests
_SHAKES = 0.1, 1.0  # [m/s2], [rad/s2]
_WHEEL = "_contact"  # ends the name of a wheel's contact geom


def check(inputs: RolloutInputs, motion: Motion, states: np.ndarray) -> None:
    """Refuse a trial; states (n, ns) before each step.

    Raises:
        Diverged: A state is not finite, or faster than anything the robot does.
        Shaking: The base does not rest before the motion.
        NotStanding: The robot tipped over, or a wheel left the plate in a trial whose base stays.
    """
    model, step = inputs.model, inputs.model.opt.timestep
    late = np.abs(states[:, 0] - np.arange(len(states)) * step) > 0.5 * step
    velocity = states[:, 1 + model.nq : 1 + model.nq + model.nv]
    with np.errstate(invalid="ignore", over="ignore"):
        fine = np.isfinite(states.sum()) and velocity.max() < _FAST and velocity.min() > -_FAST
    if late.any() or not fine:
        _refuse_diverged(inputs, motion, states, np.abs(velocity), late)
    T = base_poses(model, states[::_EVERY, 1 : 1 + model.nq])
    _refuse(T[:, 2, 2] < _MIN_UPRIGHT, "the robot tips over", motion, _EVERY * step)
    if motion.base is None:
        _on_plate(inputs, motion, T)
    _at_rest(inputs, motion, velocity)


def _at_rest(inputs: RolloutInputs, motion: Motion, velocity: np.ndarray) -> None:
    model, h = inputs.model, inputs.model.opt.timestep
    still = velocity[inputs.settling - round(_STILL / h) : inputs.settling]
    changes = np.diff(base_velocities(model, still), n=2, axis=0).reshape(-1, 2, 3) / h
    flips = np.sqrt((changes**2).sum(axis=2).mean(axis=0))
    if (flips > _SHAKES).any():
        energy = model.dof_M0 * (np.diff(still, n=2, axis=0) ** 2).mean(axis=0)
        joint = model.joint(model.dof_jntid[int(np.argmax(energy))]).name
        raise BaseVibrates(motion.id, (float(flips[0]), float(flips[1])), str(joint))


def _refuse_diverged(
    inputs: RolloutInputs, motion: Motion, states: np.ndarray, speed: np.ndarray, late: np.ndarray
) -> None:
    """Say when it first happens, and to which joint."""
    with np.errstate(invalid="ignore"):
        bad = late | ~np.isfinite(states).all(axis=1) | ~(speed < _FAST).all(axis=1)
    if bad.any():
        k, model = int(np.argmax(bad)), inputs.model
        fastest = _fastest(model, speed[max(k - 1, 0) : k + 1], late[k])
        raise Diverged(motion.id, k * model.opt.timestep - SETTLE, fastest)


def _fastest(model: mujoco.MjModel, speed: np.ndarray, reset: bool) -> str:
    """Joint that moves fastest in the last row, or in the one before it where that has been reset."""
    row = np.nan_to_num(speed[0 if reset else -1], nan=np.inf)
    return str(model.joint(model.dof_jntid[int(np.argmax(row))]).name)


def _on_plate(inputs: RolloutInputs, motion: Motion, T_lab_base: np.ndarray) -> None:
    model = inputs.model
    data = mujoco.MjData(model)
    data.qpos[:] = inputs.first[1 : 1 + model.nq]
    mujoco.mj_kinematics(model, data)
    base, plate = data.body(ROOT), data.geom("plate")
    half, R_lab_plate = model.geom("plate").size[:2], plate.xmat.reshape(3, 3)
    for i in range(model.ngeom):
        name = model.geom(i).name
        if name.endswith(_WHEEL):
            p_base = base.xmat.reshape(3, 3).T @ (data.geom_xpos[i] - base.xpos)
            p_plate = (T_lab_base[:, :3, :3] @ p_base + T_lab_base[:, :3, 3] - plate.xpos) @ R_lab_plate[:, :2]
            left = (np.abs(p_plate) > half).any(axis=1)
            _refuse(left, f"{name.removesuffix(_WHEEL)} is off the plate", motion, _EVERY * model.opt.timestep)
            on_seam = (np.abs(p_plate[:, None] - _seams(model)) < _SEAM).any(axis=(1, 2))
            what = f"{name.removesuffix(_WHEEL)} is on a seam of plate_grid and would touch both plates"
            _refuse(on_seam, what, motion, _EVERY * model.opt.timestep)


def _seams(model: mujoco.MjModel) -> np.ndarray:
    """Where plates meet (n, 2), x and y from the whole square's centre [m], NaN for the other axis."""
    centres = np.array([model.body(model.site(name).bodyid[0]).pos[:2] for name in plate_sites(model)]).reshape(-1, 2)
    found = [np.empty((0, 2))]
    for axis in range(2):
        along = np.unique(np.round(centres[:, axis], 9))
        seams = np.full((max(len(along) - 1, 0), 2), np.nan)
        seams[:, axis] = 0.5 * (along[1:] + along[:-1])
        found.append(seams)
    return np.concatenate(found)


def _refuse(found: np.ndarray, what: str, motion: Motion, step: float) -> None:
    """Say when it first happens."""
    if found.any():
        raise RobotFell(f"trial {motion.id!r}: {what} at {int(np.argmax(found)) * step - SETTLE:.2f} s")
