"""Held-out errors of single markers in posture means, and how many are within the bands stated for them.

Two bands: of the session the robot was calibrated in, which trials for validation belong to, and of any other session,
where base and marker body are not quite where they were (`Session()`). The first follows from the calibration's own
covariances, the second from assumed widths that no single session can show.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from calibration.estimate.estimate import Estimate
from calibration.estimate.rows import LADDER
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
        band_95_mm: Median radius within which 95 % should be, in the session calibrated in [mm].
        inside: Share within their own posture's radius [-].
        other_day_band_95_mm: The same radius in any other session [mm].
        other_day_inside: Share within that [-].
    """

    trial: str
    model: str
    marker: str
    n: int
    rmse_norm_mm: float
    max_norm_mm: float
    band_95_mm: float
    inside: float
    other_day_band_95_mm: float
    other_day_inside: float


def point_rows(
    estimate: Estimate, description: Description, recorded: Iterable[tuple[TrialEntry, PostureMeans]]
) -> tuple[PointRow, ...]:
    """Rows of every model that places the hand, for trials that hold posture means; none of an unknown robot."""
    if estimate.urdf is None or estimate.robot is None:
        return ()
    means, found = tuple(recorded), list[PointRow]()
    for model in estimate.models if means else ():
        if any(row.means and row.geometry == model.name for row in LADDER):
            robot = Compensator.of(replace(estimate, main=model.name))
            found += [row for one in means for row in _of_trial(robot, model.name, description, *one)]
    return tuple(found)


def _of_trial(
    robot: Compensator, model: str, description: Description, entry: TrialEntry, means: PostureMeans
) -> list[PointRow]:
    hand, T_B_lab = description.hand_body, inverse(poses_of_means(description.base_body, means).T)
    seen = [m for m in hand.markers if m.name in means.marker]
    p = means.marker_position[:, [means.marker.index(m.name) for m in seen]]
    p = p @ np.swapaxes(T_B_lab[:, :3, :3], 1, 2) + T_B_lab[:, None, :3, 3]
    xyz = np.array([m.xyz for m in seen])
    same, other = (robot.points(xyz, means.q_motor, session) for session in (None, Session()))
    error = 1e3 * np.linalg.norm(same.positions - p, axis=2)
    radii = 1e3 * np.stack([same.radius_95, other.radius_95])
    columns = [(m.name, [k]) for k, m in enumerate(seen)] + [(ALL, list(range(len(seen))))]
    return [
        PointRow(entry.id, model, name, *_figures(error[:, k], radii[:, :, k]))
        for name, k in columns
        if np.isfinite(error[:, k]).any()
    ]


def _figures(error: np.ndarray, radii: np.ndarray) -> tuple[int, float, float, float, float, float, float]:
    """The figures of a row from distances (n, m) and radii of both bands (2, n, m) [mm]."""
    good = np.isfinite(error)
    e, r = error[good], radii[:, good]
    band, inside = np.median(r, axis=1), (e <= r).mean(axis=1)
    figures = (float(np.sqrt((e**2).mean())), float(e.max()), float(band[0]), float(inside[0]))
    return len(e), *figures, float(band[1]), float(inside[1])
