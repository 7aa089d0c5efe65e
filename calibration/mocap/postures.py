"""Static postures: what the encoders read and where the hand was in the base, with covariance.

Means over each dwell, shrunk on both sides; robot samples are taken at the mocap clock. The hand's pose in the base is
that of the two clusters' averaged markers. Its local twist has covariance

    S = f (C_hand + Ad(T_H_B) C_base Ad(T_H_B)') sigma^2 / n

f >= 1 says how much more the means of quarter dwells scatter than independent samples of sigma would: noise that is
correlated in time, and motion that has not died out.
"""

import logging
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, fields, replace

import numpy as np

from calibration.errors import NotEnoughData
from calibration.mocap.cluster_pose import (
    BodyPoses,
    body_poses,
    point_of_means,
    poses_as_seen,
    poses_of_means,
    shown_shape,
    still_poses,
)
from calibration.mocap.dwells import inner_windows
from calibration.mocap.measured_trial import MeasuredTrial, hand_covariance
from calibration.mocap.partly_seen import Markers, completed
from calibration.numerics.lie import compose, inverse, skew, to_vector
from calibration.numerics.signals import GAP, interpolate_columns
from calibration.recording.clock import Clock
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Body, Description
from calibration.recording.trial import REST, Trial

Nominal = Callable[[np.ndarray], np.ndarray]
BLOCKS = 4
_SEEN = 0.2  # share of a dwell in which a marker must be seen
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Postures:
    """Static postures of a dataset.

    Attributes:
        q: (n, n_measured) mean motor-side readings [rad, m].
        T_base_hand: (n, 4, 4) measured pose of the hand body in the base body; its rotation means nothing where only a
            point of the hand was seen.
        covariance: (n, 6, 6) of its local twist [m, rad]; (n, 3, 3) of its position in the base body's axes where only
            a point was seen; `T_base_hand` then has that point's place.
        misfit: (n,) rms distance of markers from their nominal places in their cluster [m].
        label: (n,) trial and number, counted from 0, or time; empty where they have no name.
        point: (3,) the point that was seen, in the hand's frame [m].
        motion: (n,) which motion a posture was passed in, counted from 0, -1 where the arm stood; it did if not given.
    """

    q: np.ndarray
    T_base_hand: np.ndarray
    covariance: np.ndarray
    misfit: np.ndarray
    label: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=str))
    point: np.ndarray = field(default_factory=lambda: np.zeros(3))
    motion: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))

    def __post_init__(self) -> None:
        if len(self.motion) != len(self.q):
            object.__setattr__(self, "motion", np.full(len(self.q), -1))

    def __len__(self) -> int:
        return len(self.q)

    @property
    def components(self) -> int:
        """Of what is measured a posture: 6 of a pose, 3 of a point."""
        return int(self.covariance.shape[1])

    def rows(self, chosen: np.ndarray) -> "Postures":
        """Some of the postures."""
        label = self.label[chosen] if len(self.label) else self.label
        T, S = self.T_base_hand[chosen], self.covariance[chosen]
        return Postures(self.q[chosen], T, S, self.misfit[chosen], label, self.point, self.motion[chosen])

    def joined(self, other: "Postures") -> "Postures":
        """These postures, then the other ones."""
        names = [f.name for f in fields(self) if f.name != "point"]
        both = {name: np.concatenate([getattr(self, name), getattr(other, name)]) for name in names}
        return replace(self, **both)


def dwell_windows(trial: Trial) -> np.ndarray:
    """Start and stop of each dwell without its margins, (n, 2) [s, mocap clock]."""
    return inner_windows(np.stack([trial.dwell_start, trial.dwell_stop], axis=1))


def static_postures(
    description: Description, trials: Iterable[Trial], robot: Clock, nominal: Nominal | None = None
) -> Postures:
    """Postures of all dwells of these trials.

    nominal: Where the robot has its tool by its drawing, (n, 4, 4) at readings (n, n_measured) [rad, m]. With it a
    dwell that shows two markers of base or hand counts in what they determine, see `mocap.partly_seen`.

    Raises:
        NotEnoughData: There is none with both clusters visible.
    """
    found = [p for trial in trials for p in _of_trial(description, trial, robot, nominal)]
    if not found:
        raise NotEnoughData("no static calibration posture shows base and hand; record a static trial with dwells")
    q, T, quarters, unit, misfit, label = (np.array(x) for x in zip(*found, strict=True))
    unit = unit * description.sigmas.marker**2
    factor = inflation(quarters, unit)
    _log.info("%d postures, noise of their means %.1f times that of independent samples", len(q), np.sqrt(factor))
    return Postures(q, T, factor * unit, misfit, label)


def mean_postures(description: Description, means: PostureMeans) -> Postures:
    """Postures of a file that only has means, those that show base and hand; their covariance is the file's own."""
    body = description.hand_body
    seen = _points if body.is_point else _poses
    T, S, squares = seen(poses_of_means(description.base_body, means), means, body)
    good = np.isfinite(T).all(axis=(1, 2)) & np.isfinite(means.q_motor).all(axis=1)
    label = np.array([f"{means.id} {k}" for k in np.flatnonzero(good)], dtype=str)
    misfit = np.sqrt(np.nanmean(squares[good], axis=1)) if squares.shape[1] else np.zeros(int(good.sum()))
    point = body.point if body.is_point else np.zeros(3)
    return Postures(means.q_motor[good], T[good], S[good], misfit, label, point)


def _poses(base: BodyPoses, means: PostureMeans, body: Body) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """T_base_hand (n, 4, 4), covariance (n, 6, 6) of its local twist, squared distances (n, m) of markers [m2]."""
    hand = poses_of_means(body, means)
    T = inverse(base.T) @ hand.T
    S = hand_covariance(T, base.covariance, hand.covariance)
    return T, S, (np.concatenate([base.residual, hand.residual], axis=1) ** 2).sum(axis=2)


def _points(base: BodyPoses, means: PostureMeans, body: Body) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same where a point of the hand is seen: its place, and that place's covariance (n, 3, 3), base's axes."""
    p, variance = point_of_means(body, means)
    R = np.swapaxes(base.T[:, :3, :3], 1, 2)
    p = (R @ (p - base.T[:, :3, 3])[..., None])[..., 0]
    G = np.concatenate([np.broadcast_to(-np.eye(3), (len(p), 3, 3)), skew(p)], axis=2)
    S = variance[:, None, None] * np.eye(3) + G @ base.covariance @ np.swapaxes(G, 1, 2)
    return compose(np.tile(np.eye(3), (len(p), 1, 1)), p), S, (base.residual**2).sum(axis=2)


def passing_postures(description: Description, trials: Iterable[Trial], robot: Clock, spacing: float) -> Postures:
    """Postures passed through every `spacing` [s] of these trials, one sample each, their first second left out."""
    found = [_passed(MeasuredTrial.of(description, trial), robot, spacing) for trial in trials]
    motion = np.repeat(np.arange(len(found)), [len(of_trial[1]) for of_trial in found])
    T, q, S, misfit, label = (np.concatenate(x) for x in zip(*found, strict=True))
    good = np.isfinite(T).all(axis=(1, 2)) & np.isfinite(q).all(axis=1)
    return Postures(q, T, S, misfit, label, motion=motion).rows(good)


def _passed(trial: MeasuredTrial, robot: Clock, spacing: float) -> tuple[np.ndarray, ...]:
    rows = passed_rows(trial.t_mocap, spacing)
    t = trial.t_mocap[rows]
    label = np.array([f"{trial.id} at {after:.1f} s" for after in t - trial.t_mocap[0]], dtype=str)
    q = readings_at(trial, robot, t, trial.q_motor)
    return trial.T_base_hand[rows], q, trial.covariance(rows), np.zeros(len(rows)), label


def passed_rows(t: np.ndarray, spacing: float) -> np.ndarray:
    """A sample every `spacing` of times t (n,) [s], the first second left out."""
    rows = np.searchsorted(t, np.arange(t[0] + REST, t[-1], spacing))
    return np.unique(rows[rows < len(t)])  # arange may pass its end by rounding


def readings_at(trial: Trial, robot: Clock, t: np.ndarray, readings: np.ndarray) -> np.ndarray:
    """Readings (m, n_joints) taken at `t_robot`, at mocap times t (n,) [s], linear; NaN outside it and in holes."""
    s = robot.from_mocap(t)
    found = interpolate_columns(s, trial.t_robot, readings, np.nan)
    after = np.clip(np.searchsorted(trial.t_robot, s), 1, len(trial.t_robot) - 1)
    found[np.diff(trial.t_robot)[after - 1] > GAP] = np.nan
    return found


def _of_trial(
    description: Description, trial: Trial, robot: Clock, nominal: Nominal | None
) -> Iterator[tuple[np.ndarray | str, ...]]:
    t_robot = robot.to_mocap(trial.t_robot)
    dwells = []
    for k, (start, stop) in enumerate(dwell_windows(trial)):
        rows = (t_robot >= start) & (t_robot <= stop)
        seen = np.flatnonzero((trial.t_mocap >= start) & (trial.t_mocap <= stop))
        if not rows.any() or len(seen) < BLOCKS:
            _log.info("%s: dwell %d has no samples", trial.id, k)
            continue
        dwells.append((k, rows, seen))
    if not dwells:
        return
    groups = [part for _, _, seen in dwells for part in (seen, *np.array_split(seen, BLOCKS))]
    base, hand = (mean_poses(body, trial, groups) for body in (description.base_body, description.hand_body))
    if nominal is not None:
        q = np.array([trial.q_motor[rows].mean(axis=0) for _, rows, _ in dwells])
        base, hand = _partly_seen(description, trial, groups, nominal(q), (base, hand))
    found = inverse(base.T) @ hand.T
    for i, (k, rows, seen) in zip(range(0, len(groups), BLOCKS + 1), dwells, strict=True):
        T = found[i : i + BLOCKS + 1]
        if not np.isfinite(T[0]).all():
            _log.info("%s: base or hand not seen in dwell %d", trial.id, k)
            continue
        covariance = hand_covariance(T[:1], base.covariance[i : i + 1], hand.covariance[i : i + 1])[0] / len(seen)
        misfit = np.sqrt(np.nanmean(np.concatenate([base.residual[i], hand.residual[i]]) ** 2) * 3.0)
        yield (
            trial.q_motor[rows].mean(axis=0),
            T[0],
            to_vector(inverse(T[:1]) @ T[1:]),
            covariance,
            misfit,
            f"{trial.id} {k}",
        )


def _partly_seen(
    description: Description,
    trial: Trial,
    groups: list[np.ndarray],
    tool: np.ndarray,
    poses: tuple[BodyPoses, BodyPoses],
) -> tuple[BodyPoses, BodyPoses]:
    """Poses of base and hand, with those of dwells, the first of each `BLOCKS` + 1 groups, that show two markers."""
    dwells = slice(None, None, BLOCKS + 1)
    if all(np.isfinite(one.T[dwells]).all() for one in poses):
        return poses
    bodies = []
    for body, one in zip((description.base_body, description.hand_body), poses, strict=True):
        xyz, means, p = _mean_markers(body, trial, groups[dwells])
        of_dwells = BodyPoses(one.T[dwells], one.residual[dwells], one.covariance[dwells])
        bodies.append(Markers(shown_shape(xyz, p), means, of_dwells))
    samples = float(np.mean([len(rows) for rows in groups[dwells]]))
    filled = []
    found = completed(bodies[0], bodies[1], tool, description.sigmas.marker**2 / samples)
    for one, more in zip(poses, found, strict=True):
        filled.append(BodyPoses(one.T.copy(), one.residual.copy(), np.array(one.covariance)))
        filled[-1].T[dwells], filled[-1].residual[dwells] = more.T, more.residual
        filled[-1].covariance[dwells] = more.covariance
    return filled[0], filled[1]


def mean_poses(body: Body, trial: Trial, groups: list[np.ndarray]) -> BodyPoses:
    """Poses of a body from its markers averaged over each group of samples."""
    return poses_as_seen(*_mean_markers(body, trial, groups)) if body.markers else still_poses(len(groups))


def _mean_markers(body: Body, trial: Trial, groups: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Markers drawn (m, 3) [m, body], their means over groups (n, m, 3) and all samples (k, m, 3) [m, lab]."""
    names = [m.name for m in body.markers if m.name in trial.marker]
    xyz = np.array([m.xyz for m in body.markers if m.name in trial.marker]).reshape(-1, 3)
    if body.markers and len(names) < 3:
        raise NotEnoughData(f"{trial.id}: body {body.name!r} needs 3 markers, {names} are recorded")
    p = trial.marker_position[:, [trial.marker.index(name) for name in names]]
    seen = np.isfinite(p).all(axis=2)
    shape = xyz if seen.all() else shown_shape(xyz, p)
    means = np.full((len(groups), *xyz.shape), np.nan)
    for k, rows in enumerate(groups):
        often = seen[rows].sum(axis=0) > _SEEN * len(rows)
        means[k, often] = np.nanmean(_of_whole_frames(shape, p[rows])[:, often], axis=0)
    return xyz, means, p


def _of_whole_frames(xyz: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Markers (n, m, 3) [m, lab] of a body, hidden ones where those seen with them have it; p where few frames do.

    A body that still settles would be bent by means of its markers over different times.
    """
    if np.isfinite(p).all():
        return p
    found = body_poses(xyz, p)
    fitted = (found.T[:, :3, :3] @ xyz.T + found.T[:, :3, 3:]).swapaxes(1, 2)
    whole = np.isfinite(fitted).all(axis=(1, 2))
    return np.where(np.isfinite(p), p, fitted)[whole] if whole.mean() > _SEEN else p


def inflation(quarters: np.ndarray, unit: np.ndarray) -> float:
    """Mean squared Mahalanobis distance, per degree of freedom, of quarter means (n, 4, 6) about their mean.

    Of postures seen in all quarters; 1 where there is none.
    """
    seen = np.isfinite(quarters).all(axis=(1, 2))
    quarters, unit = quarters[seen], unit[seen]
    if not len(quarters):
        return 1.0
    d = quarters - quarters.mean(axis=1, keepdims=True)
    squared = np.einsum("nki,nij,nkj->n", d, np.linalg.inv(unit * BLOCKS), d)
    return max(1.0, float(squared.mean()) / (6 * (BLOCKS - 1)))
