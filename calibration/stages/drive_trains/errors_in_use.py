"""How far drive trains in use are off, by the link encoders of the calibration trials.

    e = q_predicted - q_link,     w = q_high - q_low the interval that is predicted for a link

both means over windows as of `joint_data`. Where an interval is open, w above a tenth of the half gap, its error is a
share of it,

    d^2 = (k mean(e^2 - residual^2) / mean(w^2 / 12) + A) / (k + A)     k  stretches in which it is open

in motion and, apart from that, at rest after the first motion: where a link has stopped it was decided once. A is what
an even distribution between both ends counts for. In dwells, sides that were believed certain included:

    s_j = max(rms e, q_95(|e|) / 1.96)     of joint j [rad]

Links stop elsewhere in their gaps in few dwells: 1.96 rms hold too few. 95 % of other dwells are below the quantile.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from calibration.mocap.postures import dwell_windows
from calibration.numerics.robust_covariance import covering_sigma
from calibration.recording.clock import Clock
from calibration.stages.drive_trains.corrected_trial import CorrectedTrial, by_link_encoders
from calibration.stages.drive_trains.drive_train import DriveTrain
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.drive_trains.fit.identification import OTHER_SIDE, SURE
from calibration.stages.drive_trains.fit.joint_data import window_means, windows
from calibration.stages.drive_trains.kernel.link_motion import HALF_GAP
from calibration.stages.drive_trains.kernel.link_streams import RESTS

_EVEN = 2.0  # A


@dataclass(frozen=True)
class _Shown:
    """What link encoders show of one joint in trials, means over windows, all (n,).

    Attributes:
        error: e [rad], NaN where there is no reading.
        width: w [rad].
        moves: Whether the motor moves.
        moved: Whether it has moved in the trial, or does.
    """

    error: np.ndarray
    width: np.ndarray
    moves: np.ndarray
    moved: np.ndarray


def with_doubts(trains: DriveTrains, corrected: Sequence[CorrectedTrial]) -> DriveTrains:
    """The drive trains, those of joints with link encoders with the d that trials they have corrected show."""
    read = [(one, by_link_encoders(trains, one)) for one in corrected if len(one.loads.t)]

    def doubted(train: DriveTrain) -> DriveTrain:
        if not np.isfinite(train.link).all() or not read:
            return train
        j = trains.joints.index(train.joint)
        parts = [_shown(one, by_links, j) for one, by_links in read]
        error, width, moves, moved = (np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(_Shown))
        open_ = np.isfinite(error) & (width > SURE * train.values[HALF_GAP])
        square, even = error**2 - train.residual**2, width**2 / 12.0
        rests = doubt(square, even, open_ & moved & ~moves)
        return replace(train, doubt=doubt(square, even, open_ & moves), doubt_at_rest=max(1.0, rests))

    return replace(trains, trains=tuple(map(doubted, trains.trains)))


def doubt(square: np.ndarray, even: np.ndarray, rows: np.ndarray) -> float:
    """d by squares of errors (n,) beside what is left anyway, and variances (n,) of even distributions [rad2]."""
    if not rows.any():
        return 1.0
    shown = max(float(square[rows].mean() / even[rows].mean()), 0.0)
    stretches = int(np.count_nonzero(np.diff(rows.astype(int), prepend=0) > 0))
    return float(np.sqrt(min((stretches * shown + _EVEN) / (stretches + _EVEN), OTHER_SIDE**2)))


def _shown(one: CorrectedTrial, by_links: CorrectedTrial, j: int) -> _Shown:
    rows = np.isfinite(one.trial.q_motor).all(axis=1)
    error = np.where(
        np.isfinite(one.trial.q_link[rows, j]), one.angles.q[:, j] - by_links.trial.q_motor[rows, j], np.nan
    )
    first = windows(one.loads.t)
    moves = np.maximum.reduceat(np.abs(one.loads.v[:, j]), first) >= RESTS
    width = (one.angles.high - one.angles.low)[:, j]
    return _Shown(window_means(error, first), window_means(width, first), moves, np.maximum.accumulate(moves))


def rest_errors(trains: DriveTrains, corrected: Sequence[CorrectedTrial], robot: Clock) -> np.ndarray:
    """(m,) s_j of each drive train's angle less its link encoder's [rad]; 0 without one."""
    found = [np.zeros((0, len(trains.trains)))]
    columns = [trains.joints.index(train.joint) for train in trains.trains]
    for one in (one for one in corrected if len(one.trial.dwell_start)):
        t, q = one.trial.t_robot, one.trial.q_motor - by_link_encoders(trains, one).trial.q_motor
        for start, stop in robot.from_mocap(dwell_windows(one.trial)):
            dwell = q[(t >= start) & (t <= stop)][:, columns]
            dwell = dwell[np.isfinite(dwell).all(axis=1)]
            found.append(dwell[:1] if len(dwell) == 0 else dwell.mean(axis=0, keepdims=True))
    return covering_sigma(np.concatenate(found))
