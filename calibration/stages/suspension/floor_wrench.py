"""Wrench of the robot's action on the floor, in frame 0: by the force plate, and by floating-base inverse dynamics.

    plate:     w = sum_p [R' f_p ; R' (m_p + (c_p - o) x f_p)]          c_p plate centre, (R, o) = T_lab_0
    dynamics:  w = -Ad*(T_0_root) tau_1..6(q, dq, ddq)                   RNEA, base at rest, nominal masses, payload

about the origin of frame 0, in its axes [N, N.m]. What the base's own motion adds to `dynamics` is known from

    M   inertia of the whole robot about that origin, (6, 6)             W, c   its weight and centre of mass

Both wrenches are low-passed at 10 Hz without delay, like the displacement: the base resonates at 4 to 6 Hz, a jolt of
0.1 s has its energy below 10 Hz, and what is above is the motion capture's noise. Nothing of 2.5 Hz would slip.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline

from calibration.numerics.lie import compose, inverse
from calibration.numerics.signals import CUTOFF, Signal, even, interpolate_columns, low_passed
from calibration.numerics.wrench import in_frame
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.laboratory import Laboratory
from calibration.robot.tree_dynamics import dynamics_along
from calibration.robot.wrist_sensor import Push

_DECIMATED = 0.005  # [s] plate samples averaged together
_INERTIA_STRIDE = 5  # samples from one composite inertia to the next
_MASS_SAMPLES = 20  # configurations the inertia is averaged over


@dataclass(frozen=True)
class Load:
    """The wrench on the floor along a trial.

    Attributes:
        signal: w (n, 6) [N, N.m, frame 0], on an even grid of the mocap clock.
        inertia: M (6, 6) about the origin of frame 0; zero where the base's inertia is in w already (plate).
        weight: [N]; zero where its change with the base's motion is in w already (plate).
        centre_of_mass: (3,) [m, frame 0].
        T_0_plate: (4, 4) centre of the first plate and axes of its readings; frame 0 for dynamics.
    """

    signal: Signal
    inertia: np.ndarray
    weight: float
    centre_of_mass: np.ndarray
    T_0_plate: np.ndarray


def plate_load(trial: Trial, plate: Clock, T_lab_0: np.ndarray, cutoff: float = CUTOFF) -> Load:
    """What the plates of a trial measured."""
    size = max(1, round(_DECIMATED / float(np.median(np.diff(trial.t_plate)))))
    n = len(trial.t_plate) // size * size
    t = plate.to_mocap(trial.t_plate[:n]).reshape(-1, size).mean(axis=1)
    lab = trial.plate_wrench[:n].reshape(-1, size, *trial.plate_wrench.shape[1:]).mean(axis=1)
    return floor_load(t, in_frame(lab, trial.plate_centre, T_lab_0), T_lab_0, trial.plate_centre[0], cutoff)


def floor_load(t: np.ndarray, w: np.ndarray, T_lab_0: np.ndarray, centre: np.ndarray, cutoff: float = CUTOFF) -> Load:
    """A wrench on the floor, w (n, 6) in frame 0 at t (n,) [s], read about a centre (3,) [m, lab]."""
    T_0_plate = inverse(T_lab_0) @ compose(np.eye(3), centre)
    return Load(low_passed(even(t, w), cutoff), np.zeros((6, 6)), 0.0, np.zeros(3), T_0_plate)


def motion_load(
    lab: Laboratory,
    t: np.ndarray,
    q_motor: np.ndarray,
    T_lab_0: np.ndarray,
    cutoff: float,
    push: Push | None = None,
    twist: np.ndarray | None = None,
) -> Load:
    """The same along readings q_motor (n, n_joints) [rad, m] at t (n,) [s, mocap clock], and what pushes the hand.

    Two further columns are how what the first joint carries leans about x and y of that joint's frame [rad].
    On a base that moves evenly with `twist` (n, 6) [m/s, rad/s, base frame]: then about its origin, in its axes.
    """
    description = lab.description
    q = low_passed(even(t, q_motor), cutoff)
    spline, T_0_root = CubicSpline(q.t, q.x), root_in_base(lab.floating, description)
    root, tree = root_at_rest(lab, T_lab_0), lab.tree if push is None else push.on(lab.tree)
    if twist is not None:
        moving = interpolate_columns(q.t, t, twist) @ T_0_root.inverse().action.T
        root = np.concatenate([moving, np.broadcast_to(root[:, 6:], moving.shape)], axis=1)
    if push is not None:
        pushed = interpolate_columns(q.t, t, push.wrench)
        root = np.concatenate([np.broadcast_to(root, (len(pushed), 12)), pushed], axis=1)
    k, a = len(tree.column), spline(q.t, 2)
    along = dynamics_along(tree, q.x[:, :k], spline(q.t, 1)[:, :k], a[:, :k], root)
    leans = (a[:, k:, None] * along.coupling[:, k : a.shape[1]]).sum(axis=1)
    w = (along.root + leans) @ T_0_root.dualAction.T
    rows = np.linspace(0, len(q.t) - 1, _MASS_SAMPLES).astype(int)
    M = T_0_root.dualAction @ along.composite[rows].mean(axis=0) @ T_0_root.inverse().action
    weight = float(M[0, 0] * np.linalg.norm(description.gravity))
    com = np.array([M[2, 4] * -1.0, M[2, 3], M[0, 4]]) / max(M[0, 0], np.finfo(float).tiny)
    return Load(Signal(q.t, -w, q.valid), M, weight, com, np.eye(4))


def composite_inertia(
    lab: Laboratory, t: np.ndarray, q_motor: np.ndarray, cutoff: float, push: Push | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (k,) [s, mocap clock], M (k, 6, 6) of the whole robot about the origin of frame 0, in its axes, and P.

    P (k, n_joints, 6): the wrench that accelerates the robot as a joint does by 1 rad/s2, or 1 m/s2.
    """
    q = low_passed(even(t, q_motor), cutoff)
    T_0_root, rows = root_in_base(lab.floating, lab.description), q.x[::_INERTIA_STRIDE]
    none, tree = np.zeros_like(rows), lab.tree if push is None else push.on(lab.tree)
    found, dual = dynamics_along(tree, rows, none, none, np.zeros((1, 12))), T_0_root.dualAction
    return q.t[::_INERTIA_STRIDE], dual @ found.composite @ T_0_root.inverse().action, found.coupling @ dual.T


def moved(M: np.ndarray, off: np.ndarray) -> np.ndarray:
    """Inertias M (n, 6, 6) of a robot that is off (2,) [m] from where it is counted, about the same origin.

    A' M A,  A = [1 -[off]x; 0 1]: the twist of the origin as the robot has it there.
    """
    return np.asarray(elsewhere(off).T @ M @ elsewhere(off))


def elsewhere(off: np.ndarray) -> np.ndarray:
    """A (6, 6), see `moved`; wrenches w (n, 6) about the origin are w A."""
    return np.asarray(pin.SE3(np.eye(3), -np.append(off, 0.0)).action)


def vertical(wrench: np.ndarray) -> np.ndarray:
    """(-Fz, My, -Mx) (n, 3) of wrenches (n, 6)."""
    return np.asarray(wrench[:, (2, 4, 3)] * (-1.0, 1.0, -1.0))


def root_in_base(model: pin.Model, description: Description) -> pin.SE3:
    """T_base_root, root = the body of the free flyer."""
    return model.frames[model.getFrameId(description.base_frame)].placement.inverse()


def root_at_rest(lab: Laboratory, T_lab_0: np.ndarray) -> np.ndarray:
    """Twist, zero, and proper acceleration (1, 12) of the root of a robot that stands at frame 0, in its axes."""
    R = T_lab_0[:3, :3] @ root_in_base(lab.floating, lab.description).rotation
    return np.concatenate([np.zeros(6), -np.array(lab.description.gravity) @ R, np.zeros(3)])[None]
