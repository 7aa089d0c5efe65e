"""What the robot's motion does to the force plate, and what the plate read.

    W = -sum_c RNEA_c(T_lab_root_c(t), q(t))[root]         action on the plate, lab axes, about its centre

The base rocks on its tyres and the torso bends, at frequencies that would shift any lag, so what can be seen is not
computed: a body of markers carries all links beyond its own, up to the next body's. For each such body c the robot is
placed so that c's link is where its markers are, at nominal places, and only the masses c carries count. The hand's
markers are not used here. Masses are nominal; errors of the ten inertial parameters of each body's link are nuisances.

Which way a plate's horizontal moments are turned or mirrored, determined before its clock is.

    y_k(t) ~ Q x_k(t - lag_k),   Q'Q = 1        min over Q, lag_k by |y - mean y| against |x - mean x|, free of Q

y moments of the moving masses in lab axes, x those of the plate, of all trials k. A sign or a turn that nobody knows
of would otherwise pass as a clock that is off by half a period of the motion, and the plate as one that saw another.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from scipy.interpolate import make_interp_spline

from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.lie import from_vector, inverse, mean, skew, to_vector
from calibration.numerics.side_by_side import side_by_side
from calibration.numerics.signals import RATE, Signal, even, interpolate_columns, low_passed
from calibration.numerics.time_delay import Pair, coarse_lag
from calibration.recording.schema import Body, Description
from calibration.recording.trial import Trial
from calibration.robot.kinematics import path_of
from calibration.robot.rigid_tree import tree_of
from calibration.robot.tree_dynamics import dynamics_along

_CUTOFF = 4.0  # [Hz]
_DECIMATED = 0.01  # [s] plate samples averaged together
_SEEN = 0.8  # share of a trial a body must be in view to carry anything
_STRIDE = 3  # the dynamics are evaluated every so many samples: 33 Hz for signals below 4 Hz
_SMALL = np.radians(20.0)  # a smaller turn does not hide the clock, and is left to those who judge the plate [rad]


@dataclass(frozen=True)
class JointMotion:
    """Joint angles of a trial.

    Attributes:
        t: (n,) [s, mocap clock].
        q: (n, n_measured) [rad, m].
    """

    t: np.ndarray
    q: np.ndarray


@dataclass(frozen=True)
class Carrier:
    """A marker body and the links it carries.

    Attributes:
        body: The markers.
        model: Free-flyer model in which only those links have mass.
    """

    body: Body
    model: pin.Model


def carriers(model: pin.Model, description: Description, trials: Sequence[Trial]) -> tuple[Carrier, ...]:
    """The base body and every other one but the hand that all trials show, each with the masses up to the next."""
    base, hand = description.base_body, description.hand_body
    others = [b for b in description.bodies if b.name not in (base.name, hand.name)]
    owner: dict[int, Body] = {1: base}  # of two bodies on one link the first carries it
    for body in (b for b in others if all(_is_seen(b, trial) for trial in trials)):
        owner.setdefault(int(model.frames[model.getFrameId(body.link)].parentJoint), body)
    nearest = [next((i for i in reversed(list(model.supports[j])) if i in owner), 1) for j in range(model.njoints)]
    return tuple(Carrier(body, _with_masses(model, [i == joint for i in nearest])) for joint, body in owner.items())


def _is_seen(body: Body, trial: Trial) -> bool:
    columns = [trial.marker.index(m.name) for m in body.markers if m.name in trial.marker]
    visible = np.isfinite(trial.marker_position[:, columns]).all(axis=2).sum(axis=1) >= 3
    return bool(visible.mean() > _SEEN)


def _with_masses(model: pin.Model, kept: Sequence[bool]) -> pin.Model:
    """A copy of the model in which only the joints `kept` carry mass."""
    copy = model.copy()
    for joint, keep in enumerate(kept):
        if not keep:
            copy.inertias[joint] = pin.Inertia.Zero()
    return copy


def plate_moments(trial: Trial) -> Signal:
    """Mx, My (n, 2) [N.m, lab] of all plates about the first plate's centre, low-passed, on the plate's clock."""
    force, moment = trial.plate_wrench[..., :3], trial.plate_wrench[..., 3:]
    moment = (moment + np.cross(trial.plate_centre - trial.plate_centre[0], force)).sum(axis=1)
    size = max(1, round(_DECIMATED / float(np.median(np.diff(trial.t_plate)))))
    n = len(trial.t_plate) // size * size
    t = trial.t_plate[:n].reshape(-1, size).mean(axis=1)
    return low_passed(even(t, moment[:n, :2].reshape(-1, size, 2).mean(axis=1)), _CUTOFF)


def model_moments(parts: Sequence[Carrier], trial: MeasuredTrial, joints: JointMotion) -> tuple[Signal, np.ndarray]:
    """The same from masses and motion, on the mocap clock, and what errors of the masses would add (n, k, 2).

    Raises:
        NotEnoughData: A body is not in view for long enough.
    """
    order = [trial.description.joint_names.index(name) for name in list(parts[0].model.names)[2:]]
    q = low_passed(even(joints.t, joints.q[:, order]), _CUTOFF)
    found = side_by_side(lambda part: _carried(part, trial, q), parts)
    whole, valid = sum(m[:, 0] for m, _ in found), np.logical_and.reduce([q.valid, *(v for _, v in found)])
    return Signal(q.t, np.asarray(whole), valid), np.concatenate([m[:, 1:] for m, _ in found], axis=1)


def _carried(part: Carrier, trial: MeasuredTrial, q: Signal) -> tuple[np.ndarray, np.ndarray]:
    """Moments (n, 11, 2) of what a body carries and of unit errors of its link's inertial parameters; validity (n,)."""
    rows = np.append(np.arange(0, len(q.t) - 1, _STRIDE), len(q.t) - 1)
    T_lab_link, valid = _link_poses(part.body, trial, q.t)
    T = T_lab_link @ inverse(_root_to_link(part, q.x))
    rates, turns, link_turns = np.gradient(q.x, 1.0 / RATE, axis=0), _body_twists(T), _body_twists(T_lab_link)
    accelerations, pushes, link_pushes = (np.gradient(v, 1.0 / RATE, axis=0) for v in (rates, turns, link_turns))
    proper = pushes[rows]
    proper[:, :3] -= part.model.gravity.linear @ T[rows, :3, :3]
    tree, root = tree_of(part.model, tuple(list(part.model.names)[2:])), np.hstack([turns[rows], proper])
    along = dynamics_along(tree, q.x[rows], rates[rows], accelerations[rows], root)
    whole = _action(T[rows], trial) @ along.root[..., None]
    R = T_lab_link[rows, :3, :3]
    at_link = link_pushes[rows]
    at_link[:, :3] -= part.model.gravity.linear @ R
    Y = np.array(
        [pin.bodyRegressor(pin.Motion(v), pin.Motion(a)) for v, a in zip(link_turns[rows], at_link, strict=True)]
    )
    found = np.concatenate([np.swapaxes(whole, 1, 2), np.swapaxes(_action(T_lab_link[rows], trial) @ Y, 1, 2)], axis=1)
    return make_interp_spline(rows, found)(np.arange(len(q.t))), valid


def _action(T_lab_frame: np.ndarray, trial: Trial) -> np.ndarray:
    """Rows (n, 2, 6): wrench that holds links, in a frame's axes -> moments Mx, My of its reaction on the plate."""
    R, p = T_lab_frame[:, :3, :3], T_lab_frame[:, :3, 3] - trial.plate_centre[0]
    return -np.concatenate([skew(p) @ R, R], axis=2)[:, :2]


def _link_poses(body: Body, trial: MeasuredTrial, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """T_lab_link (n, 4, 4) at t with the link where the body's markers are, smooth, and validity (n,)."""
    T = trial.poses(body).T @ inverse(from_vector(np.array(body.placement)))
    if not np.isfinite(T).any():
        raise NotEnoughData(f"{trial.id}: body {body.name!r} is never in view")
    middle = mean(T)
    moved = low_passed(even(trial.t_mocap, to_vector(inverse(middle) @ T)), _CUTOFF)
    at = interpolate_columns(t, moved.t, moved.x)
    valid = np.interp(t, moved.t, moved.valid.astype(float), 0.0, 0.0) == 1.0
    return middle @ from_vector(at), valid


def _root_to_link(part: Carrier, q: np.ndarray) -> np.ndarray:
    """T_root_link (n, 4, 4) at joint positions q (n, k), columns in the model's order."""
    model, link = part.model, part.model.getFrameId(part.body.link)
    path = path_of(model, model.getFrameId(model.names[1]), link)
    joints = list(model.supports[model.frames[link].parentJoint])[2:]
    return path.poses(q[:, [i - 2 for i in joints]])


def _body_twists(T: np.ndarray) -> np.ndarray:
    """Local twists (n, 6) [m/s, rad/s] of poses (n, 4, 4) on the grid, central differences."""
    before, after = np.concatenate([T[:1], T[:-1]]), np.concatenate([T[1:], T[-1:]])
    return to_vector(inverse(before) @ after) * 0.5 * RATE


def plate_axes(pairs: Sequence[Pair]) -> np.ndarray:
    """Q (2, 2), exactly the identity unless the plate is mirrored or turned by more than 20 deg."""
    C = np.zeros((2, 2))
    for pair in pairs:
        y, x = _centred(pair.y), _centred(pair.x)
        s = y.t - coarse_lag(length(y), length(x))
        at = interpolate_columns(s, x.t, x.x, 0.0)
        C += y.x.T @ at
    U, _, Vt = np.linalg.svd(C)
    Q = U @ Vt
    is_usual = np.linalg.det(Q) > 0.0 and abs(np.arctan2(Q[1, 0], Q[0, 0])) < _SMALL
    return np.eye(2) if is_usual else np.asarray(Q)


def _centred(signal: Signal) -> Signal:
    return replace(signal, x=signal.x - signal.x.mean(axis=0))


def length(signal: Signal) -> Signal:
    """Norm (n, 1) of each sample."""
    return replace(signal, x=np.linalg.norm(signal.x, axis=1, keepdims=True))
