"""Drive train of a joint without a link encoder, from the hand's markers through the chain.

    r(t) = log6( (Q^-1 T_measured)^-1 T_B_H(q) ) = J_j delta_j(t) + geometry, noise         q of other joints corrected
    y_j = (J_j' W J_j)^-1 J_j' W r        W^-1  covariance of the two marker bodies' poses + sum_k J_k J_k' s_k^2

k are joints whose drive trains are not known yet, s_k the datasheet's backlash of each: what only they move says
nothing of j. Where no joint has a link encoder all are found so, and once more with each other corrected.

The geometry is one fitted to link angles of the joints that have an encoder, its column bent as `column_bending` says.
y_j takes the place of motor minus link reading: the same fit, windows weighted by what the markers say of this joint
there. The zero and the eccentricity that it finds are the motor encoder's beside the geometry.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.lie import inverse, log6
from calibration.numerics.signals import interpolate_columns
from calibration.recording.clock import Clock
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel
from calibration.stages.drive_trains.column_bending import ColumnBending, bent
from calibration.stages.drive_trains.drive_train import DriveTrain
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.drive_trains.fit.identification import identify
from calibration.stages.drive_trains.fit.joint_data import COARSE, WINDOW, JointData, joint_data
from calibration.stages.drive_trains.geometry_refit import NOTHING, RefittedGeometry, refit_geometry
from calibration.stages.drive_trains.stage import (
    AS_SEEN,
    DEFLECTION,
    STAGE,
    Moved,
    is_long,
    loads_of_trial,
    relaxation,
    unidentified,
)
from calibration.stages.drive_trains.torques import LinkLoads, load_modes
from calibration.stages.geometry.parameters import reading_sigma
from calibration.verdict import Verdict

_POSTURE = 15.0  # [s] errors hang together: the geometry is off by posture
_FLOOR = 1e-4  # [rad] a joint's angle is known to through the chain, however long its levers


@dataclass(frozen=True)
class SeenJoint:
    """What the markers say of a joint in a trial, all (n,) at the readings' times.

    Attributes:
        y: Motor reading less the joint's angle [rad], NaN where the hand is not seen.
        variance: Of it, one sample [rad2].
    """

    y: np.ndarray
    variance: np.ndarray


def completed(
    chain: Chain,
    trials: Sequence[Trial],
    robot: Clock,
    hand: HandModel,
    trains: DriveTrains,
    loads: Mapping[str, LinkLoads] = NOTHING,
    moved: Moved = AS_SEEN,
) -> tuple[RefittedGeometry, tuple[Verdict, ...]]:
    """Geometry on link angles, with the drive trains of joints without a link encoder, and which those are.

    Their geometry is fitted with those there are, and again with all; arguments as of `refit_geometry`.

    Raises:
        NotEnoughData: No joint has a drive train: neither link encoders nor the hand's markers show one.
    """
    found = refit_geometry(chain, trials, robot, hand, trains, loads, moved)
    have = [train.joint for train in trains.trains]
    if all(joint in have or chain.is_prismatic(joint) for joint in chain.joints):
        return found, ()
    new: list[str] = []
    for _ in range(1 if have else 3):
        more = with_hand_markers(found.trains, trials, robot, found.hand(chain), found.bending, new or None, moved)
        new = [train.joint for train in more.trains if train.joint not in have]
        if not more.trains:
            raise NotEnoughData("neither link encoders nor the hand's markers show a drive train in motion")
        if not new:
            return found, ()
        found = refit_geometry(chain, trials, robot, found.hand(chain), more, moved=moved)
    summary = Verdict(STAGE, "ok", f"without a link encoder, from the hand's markers: {', '.join(new)}")
    return found, (summary, *unidentified([train for train in found.trains.trains if train.joint in new]))


def with_hand_markers(
    trains: DriveTrains,
    trials: Sequence[Trial],
    robot: Clock,
    hand: HandModel,
    bending: ColumnBending,
    joints: Sequence[str] | None = None,
    moved: Moved = AS_SEEN,
) -> DriveTrains:
    """The drive trains with those of further joints (of all revolute ones that have none), by the hand's markers.

    Joints that the hand's markers do not show are left out.
    """
    have = [train.joint for train in trains.trains]
    others = [j for j in hand.chain.joints if not hand.chain.is_prismatic(j) and j not in have]
    wanted = others if joints is None else joints
    found = trains
    if not wanted:
        return found
    used = [trial for trial in trials if is_long(trial)]
    loads = [loads_of_trial(trains, trial, robot, hand, moved.get(trial.id)) for trial in used]
    for joint in wanted:
        try:
            train = identified_by_markers(found, joint, used, loads, robot, hand, bending)
        except NotEnoughData:
            continue
        kept = [t for t in found.trains if t.joint != joint]
        order = sorted([*kept, train], key=lambda t: trains.joints.index(t.joint))
        found = replace(found, trains=tuple(order))
    return found


def identified_by_markers(
    trains: DriveTrains,
    joint: str,
    trials: Sequence[Trial],
    loads: Sequence[LinkLoads],
    robot: Clock,
    hand: HandModel,
    bending: ColumnBending,
) -> DriveTrain:
    """The drive train of one joint; the other joints are corrected by those there are.

    Raises:
        NotEnoughData: No trial shows the hand.
    """
    bare = replace(trains, trains=tuple(t for t in trains.trains if t.joint != joint))
    j = trains.joints.index(joint)
    own, seen = [], []
    for trial, load in zip(trials, loads, strict=True):
        try:
            seen.append(seen_joint(bare, load, trial, robot, hand, bending, joint))
        except NotEnoughData:
            continue
        delta = load.q - bare.likely(load)
        delta[:, j] = np.nan_to_num(seen[-1].y - np.nanmedian(seen[-1].y))
        own.append(load.behind(delta))
    if not own:
        raise NotEnoughData(f"no calibration trial shows base and hand: {joint} has neither link encoder nor markers")
    tolerances = trains.description.tolerances
    C = trains.inertial_tolerances
    modes = load_modes(own, j, np.linalg.cholesky(C + 1e-12 * np.eye(len(C))))
    relaxes = relaxation(hand, joint)
    data, coarse = (replace(_data(own, seen, j, modes, window), relaxation=relaxes) for window in (WINDOW, COARSE))
    found, _ = identify(joint, data, coarse, modes, tolerances.joint_play, DEFLECTION, float(trains.dynamics.offset[j]))
    names = [q for q in found.parameters if ".link." not in q.name]
    return replace(found, link=np.full(5, np.nan), parameters=tuple(names))


def seen_joint(
    trains: DriveTrains,
    loads: LinkLoads,
    trial: Trial,
    robot: Clock,
    hand: HandModel,
    bending: ColumnBending,
    joint: str,
) -> SeenJoint:
    """Motor reading less joint angle of a joint as the hand's markers show it, other joints as `trains` has them."""
    seen = MeasuredTrial.of(trains.description, trial)
    T, C = seen.T_base_hand, seen.covariance(np.arange(len(trial.t_mocap)))
    q = trains.of_loads(loads).q  # the geometry is of link angles
    s = robot.from_mocap(trial.t_mocap)
    at, moment = (interpolate_columns(s, loads.t, x) for x in (q, loads.moment))
    known = np.isfinite(T).all(axis=(1, 2)) & np.isfinite(C).all(axis=(1, 2))
    if known.sum() < 2:
        raise NotEnoughData(f"{trial.id}: the hand is not seen")
    y, variance = np.full(len(T), np.nan), np.full(len(T), np.nan)
    r = log6(inverse(T[known]) @ bent(hand, bending, at[known], moment[known]))
    every = hand.joint_jacobians(at[known])
    J = every[:, :, hand.chain.joints.index(joint)]
    others = every * _unknown(trains, hand.chain, joint)
    WJ = np.linalg.solve(C[known] + others @ np.swapaxes(others, 1, 2), J[..., None])[..., 0]
    information = (J * WJ).sum(axis=1)
    y[known], variance[known] = (WJ * r).sum(axis=1) / information, 1.0 / information
    t = robot.to_mocap(loads.t)
    near = np.clip(np.searchsorted(trial.t_mocap, t), 0, len(t) - 1)
    rows = np.flatnonzero(known)
    found = np.interp(t, trial.t_mocap[rows], y[rows])
    hidden = ~known[np.minimum(near, len(known) - 1)] | (t < trial.t_mocap[0]) | (t > trial.t_mocap[-1])
    return SeenJoint(np.where(hidden, np.nan, found), np.interp(t, trial.t_mocap[rows], variance[rows]))


def _unknown(trains: DriveTrains, chain: Chain, joint: str) -> np.ndarray:
    """Standard deviations (k,) [rad] of the chain's other joints: the backlash, or what their drive trains leave."""
    known = {train.joint: train.residual for train in trains.trains}
    play = dict(zip(chain.joints, reading_sigma(chain, trains.description), strict=True))
    sliding = {name for name in chain.joints if chain.is_prismatic(name)} | {joint}
    return np.array([0.0 if name in sliding else known.get(name, play[name]) for name in chain.joints])


def _data(
    loads: Sequence[LinkLoads], seen: Sequence[SeenJoint], column: int, modes: np.ndarray, window: float
) -> JointData:
    k = loads[0].q.shape[1]
    differences = [np.tile(s.y[:, None], (1, k)) for s in seen]
    data = joint_data(loads, differences, column, modes, window)
    count = np.diff(np.append(data.first, len(data.motion.t)))
    variance = data.means(np.concatenate([s.variance for s in seen])) / count + _FLOOR**2
    return replace(data, weight=np.median(variance) / variance, correlated=_POSTURE)
