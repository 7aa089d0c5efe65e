"""Gravity torques of a chain, all configurations at once.

    tau_j = dV/dq_j = -g . (a_j x sum_{i >= j} m_i (p_i - o_j))      revolute [N.m], about axis a_j through o_j
    tau_j = -g . a_j sum_{i >= j} m_i                                 prismatic [N]

what the motors must give at rest. m_i and p_i are mass and centre of what joint i carries up to the next joint of the
chain; joints off the chain stay at neutral.

Gravity torque of the nominal model at every measured joint.

    tau = dV/dq (q)      what the motors must give at rest [N.m, N], the base level, the declared payload in the hand

It must be asked at angles, not at raw readings: an elbow turned by 0.1 rad changes the load of the wrist.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from calibration.errors import ShapeError
from calibration.numerics.lie import skew
from calibration.robot.kinematics import Path


@dataclass(frozen=True)
class Loads:
    """Masses along a chain of k joints.

    Attributes:
        mass: (k,) behind each joint [kg].
        centre: (k, 3) centre of mass in the joint's own frame [m].
        gravity: (3,) in the frame the path starts from [m/s2].
    """

    mass: np.ndarray
    centre: np.ndarray
    gravity: np.ndarray


def loads_of(model: pin.Model, joints: tuple[str, ...], base_frame: str) -> Loads:
    """Loads of a model's chain, everything else rigid at neutral."""
    others = [i for i in range(1, model.njoints) if model.names[i] not in joints]
    chain = pin.buildReducedModel(model, others, pin.neutral(model)) if others else model
    bodies = [chain.inertias[chain.getJointId(name)] for name in joints]
    R = model.frames[model.getFrameId(base_frame)].placement.rotation
    return Loads(np.array([b.mass for b in bodies]), np.array([b.lever for b in bodies]), R.T @ model.gravity.linear)


def gravity_torques(path: Path, loads: Loads, q: np.ndarray) -> np.ndarray:
    """Torques (n, k) [N.m, N] that hold the joints at positions q (n, k) [rad, m]."""
    axis, lever, carried, _ = _carried(path, loads, q)
    # -g . (a x lever) = (g x a) . (-lever)
    turning = -(lever * (skew(loads.gravity) @ axis.reshape(3, -1)).reshape(axis.shape)).sum(axis=0)
    sliding = -(loads.gravity @ axis.reshape(3, -1)).reshape(q.shape) * carried
    return np.where(path.prismatic, sliding, turning)


def gravity_moments(path: Path, loads: Loads, q: np.ndarray) -> np.ndarray:
    """Moments (n, k, 3) [N.m] across each joint's axis, about all axes where it slides, in the joint's frame at rest.

    R_j' (I - a a') (g x lever_j)
    """
    axis, lever, _, R = _carried(path, loads, q)
    M = (skew(loads.gravity) @ lever.reshape(3, -1)).reshape(lever.shape)
    M = M - np.where(path.prismatic, 0.0, (M * axis).sum(axis=0) * axis)
    return np.asarray((M[..., None] * R).sum(axis=0))


def _carried(path: Path, loads: Loads, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Axes (3, n, k), mass times lever of all they carry (3, n, k) [kg.m], mass (k,), rotations (3, n, k, 3)."""
    placed, axes = path.placed(q), path.axis
    after = np.concatenate([placed.R[:, :, 1:], placed.T[:, :3, None, :3].transpose(1, 0, 2, 3)], axis=2)
    centre = (path.fixed[1:, :3, :3].swapaxes(1, 2) @ loads.centre[..., None])[..., 0]  # seen from the next joint
    axis = (placed.R * axes).sum(axis=3)
    moment = placed.p + (after * centre).sum(axis=3) + np.where(path.prismatic, q, 0.0) * axis
    carried = np.cumsum(loads.mass[::-1])[::-1]
    lever = np.cumsum((loads.mass * moment)[..., ::-1], axis=2)[..., ::-1] - carried * placed.p
    return axis, lever, carried, placed.R


def floating_gravity_torques(model: pin.Model, measured: tuple[str, ...], q: np.ndarray) -> np.ndarray:
    """Gravity torques (n, n_measured) of a floating model held level, at joint positions q (n, n_measured) [rad, m].

    Args:
        model: As `inverse_dynamics.floating_model` builds it: root joint first, payload included.
        measured: The joints of the columns of q.
        q: Joint positions, zeros of the readings taken off.
    """
    if q.ndim != 2 or q.shape[1] != len(measured):
        raise ShapeError("q", q.shape, ("n", len(measured)))
    data, neutral = model.createData(), pin.neutral(model)
    ids = [model.joints[model.getJointId(name)].idx_v for name in measured]
    tau, step = np.empty_like(q), np.zeros(model.nv)
    for row, q_row in enumerate(q):
        step[ids] = q_row
        tau[row] = pin.computeGeneralizedGravity(model, data, pin.integrate(model, neutral, step))[ids]
    return tau
