"""Held-out errors of single markers in posture means, and how many are within the band promised for any day."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from calibration.estimate.estimate import Estimate
from calibration.mocap.cluster_pose import poses_of_means
from calibration.numerics.lie import inverse
from calibration.prediction.compensator import Compensator
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Description, TrialEntry
from calibration.robot.hand_uncertainty import Session

ALL = "all"


@dataclass(frozen=True)
class PointRow:
    """Errors of one marker in one trial.

    Attributes:
        trial: The trial.
        model: Row of the ladder.
        marker: Its name; `all` for all together.
        n: Positions compared.
        rmse_norm_mm: Root mean squared distance [mm].
        max_norm_mm: Largest distance [mm].
        band_95_mm: Median radius within which 95 % are promised to be in any session [mm].
        inside: Share within their own posture's radius [-].
    """

    trial: str
    model: str
    marker: str
    n: int
    rmse_norm_mm: float
    max_norm_mm: float
    band_95_mm: float
    inside: float


def point_rows(
    estimate: Estimate, description: Description, recorded: Iterable[tuple[TrialEntry, PostureMeans]]
) -> tuple[PointRow, ...]:
    """Rows of the main model for trials that hold posture means; none where the robot is not known."""
    if estimate.urdf is None or estimate.robot is None:
        return ()
    robot, found = Compensator.of(estimate), []
    for entry, means in recorded:
        found += _of_trial(robot, estimate.main, description, entry, means)
    return tuple(found)


def _of_trial(
    robot: Compensator, model: str, description: Description, entry: TrialEntry, means: PostureMeans
) -> list[PointRow]:
    hand, T_B_lab = description.hand_body, inverse(poses_of_means(description.base_body, means).T)
    seen = [m for m in hand.markers if m.name in means.marker]
    p = means.marker_position[:, [means.marker.index(m.name) for m in seen]]
    p = p @ np.swapaxes(T_B_lab[:, :3, :3], 1, 2) + T_B_lab[:, None, :3, 3]
    predicted = robot.points(np.array([m.xyz for m in seen]), means.q_motor, Session())
    error, radius = 1e3 * np.linalg.norm(predicted.positions - p, axis=2), 1e3 * predicted.radius_95
    columns = [(m.name, [k]) for k, m in enumerate(seen)] + [(ALL, list(range(len(seen))))]
    rows = [_row(entry.id, model, name, error[:, k], radius[:, k]) for name, k in columns]
    return [row for row in rows if row.n]


def _row(trial: str, model: str, marker: str, error: np.ndarray, radius: np.ndarray) -> PointRow:
    good = np.isfinite(error)
    e, r = error[good], radius[good]
    if not len(e):
        return PointRow(trial, model, marker, 0, 0.0, 0.0, 0.0, 0.0)
    rms, inside = float(np.sqrt((e**2).mean())), float((e <= r).mean())
    return PointRow(trial, model, marker, len(e), rms, float(e.max()), float(np.median(r)), inside)
