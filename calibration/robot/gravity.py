"""Gravity torques of all measured joints of a robot on a level base, with its payload, all configurations at once.

    tau_j = dV/dq_j = -g . (a_j x sum_i m_i (p_i - o_j))     revolute [N.m], about axis a_j through o_j
    tau_j = -g . a_j sum_i m_i                               prismatic [N]

what the motors must exert at rest, summed over all bodies i that joint j carries. m_i and p_i are mass and centre of
body i, all that is rigid with joint i at the neutral position of the joints that are not measured, the payload in the
hand included. It is a function of joint angles: an elbow turned by 0.1 rad changes the load of the wrist.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from calibration.errors import ShapeError
from calibration.numerics.lie import skew
from calibration.recording.schema import Payload
from calibration.robot.kinematics import turned, unit_twists


@dataclass(frozen=True)
class Loads:
    """The tree of bodies moved by k measured joints, parents before children.

    Attributes:
        column: (k,) column of each joint in every `q`.
        parent: (k,) index of the body that carries each joint, -1 for the base.
        fixed: (k, 4, 4) joint frame in that body's.
        axis: (k, 3) unit axis in the joint's frame.
        prismatic: (k,) whether a joint slides.
        mass: (k,) of each body [kg], without the payload.
        centre: (k, 3) its centre of mass in the joint's frame [m].
        gravity: (3,) in the base [m/s2].
        carrier: Index of the body that carries the payload.
        payload: Mass of the payload [kg].
        lever: (3,) its centre of mass in that body's frame [m].
    """

    column: np.ndarray
    parent: tuple[int, ...]
    fixed: np.ndarray
    axis: np.ndarray
    prismatic: np.ndarray
    mass: np.ndarray
    centre: np.ndarray
    gravity: np.ndarray
    carrier: int
    payload: float
    lever: np.ndarray

    def carrying(self, mass: float | None) -> "Loads":
        """The same robot with another mass [kg] of its payload; itself where None."""
        return self if mass is None else replace(self, payload=mass)


def loads_of(
    model: pin.Model, measured: tuple[str, ...], payload: Payload | None, gravity: tuple[float, float, float]
) -> Loads:
    """Loads of a model on a fixed base whose joints are the measured ones.

    Args:
        model: As `reduced_model` builds it.
        measured: Names of the columns of q.
        payload: Declared payload, None where there is none.
        gravity: In the base [m/s2].
    """
    ids, S = range(1, model.njoints), unit_twists(model)[1:]
    prismatic = np.abs(S[:, :3]).max(axis=1, initial=0.0) > 0.5
    carrier, mass, lever = -1, 0.0, np.zeros(3)
    if payload is not None:
        frame = model.frames[model.getFrameId(payload.link)]
        carrier, mass, lever = frame.parentJoint - 1, payload.mass, frame.placement.act(np.array(payload.com))
    return Loads(
        np.array([measured.index(model.names[i]) for i in ids]),
        tuple(model.parents[i] - 1 for i in ids),
        np.array([model.jointPlacements[i].homogeneous for i in ids]),
        np.where(prismatic[:, None], S[:, :3], S[:, 3:]),
        prismatic,
        np.array([model.inertias[i].mass for i in ids]),
        np.array([model.inertias[i].lever for i in ids]),
        np.array(gravity),
        carrier,
        mass,
        lever,
    )


def gravity_torques(loads: Loads, q: np.ndarray) -> np.ndarray:
    """Torques (n, n_measured) [N.m, N] that hold the joints at positions q (n, n_measured) [rad, m]."""
    R, lever, carried = _carried(loads, q)
    axis = (R @ loads.axis[..., None])[..., 0]
    # -g . (a x lever) = (g x a) . (-lever)
    turning = -(lever * (axis @ skew(loads.gravity).T)).sum(axis=2)
    sliding = -(axis @ loads.gravity) * carried
    tau = np.empty_like(q)
    tau[:, loads.column] = np.where(loads.prismatic, sliding, turning)
    return tau


def gravity_moments(loads: Loads, q: np.ndarray) -> np.ndarray:
    """Moments (n, n_measured, 3) [N.m] across each joint's axis, about all axes where it slides, in its frame at rest.

    R_j' (I - a a') (g x lever_j)
    """
    R, lever, _ = _carried(loads, q)
    M = ((lever @ skew(loads.gravity).T)[..., None, :] @ R)[..., 0, :]
    across = M - np.where(loads.prismatic[:, None], 0.0, (M * loads.axis).sum(axis=2, keepdims=True) * loads.axis)
    moments = np.empty((*q.shape, 3))
    moments[:, loads.column] = across
    return moments


def _carried(loads: Loads, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joint frames before their motion (n, k, 3, 3), mass times lever carried (n, k, 3) [kg.m], mass carried (k,)."""
    if q.ndim != 2 or q.shape[1] != len(loads.column):
        raise ShapeError("q", q.shape, ("n", len(loads.column)))
    (n, k), carried = q.shape, loads.mass.copy()
    before, after = np.empty((n, k, 3, 3)), np.empty((n, k, 3, 3))
    origin, moment, p = np.empty((n, k, 3)), np.empty((n, k, 3)), np.empty((n, k, 3))
    for i, (j, F) in enumerate(zip(loads.parent, loads.fixed, strict=True)):
        rows, o = (np.tile(np.eye(3), (n, 1)), 0.0) if j < 0 else (after[:, j].reshape(-1, 3), p[:, j])
        R, origin[:, i] = (rows @ F[:3, :3]).reshape(n, 3, 3), o + (rows @ F[:3, 3]).reshape(n, 3)
        angle, slides = q[:, loads.column[i]], loads.prismatic[i]
        before[:, i], after[:, i] = R, R if slides else turned(R, loads.axis[i], angle)
        p[:, i] = origin[:, i] + (R @ loads.axis[i] * angle[:, None] if slides else 0.0)
        moment[:, i] = loads.mass[i] * (p[:, i] + after[:, i] @ loads.centre[i])
    if loads.carrier >= 0:
        carried[loads.carrier] += loads.payload
        moment[:, loads.carrier] += loads.payload * (p[:, loads.carrier] + after[:, loads.carrier] @ loads.lever)
    for i in range(k - 1, -1, -1):
        if (j := loads.parent[i]) >= 0:
            carried[j] += carried[i]
            moment[:, j] += moment[:, i]
    return before, moment - carried[:, None] * origin, carried
