"""Errors of predicted poses, and the figures of one row of the ladder.

    e = p_predicted - p_reference [m, lab]        phi = log3(R_predicted R_reference') [rad, lab]

RMSE per component is sqrt(mean of the 3 N squared components), the published convention; of the norm it is sqrt(3)
larger. Orientation is the geodesic |phi|, never a difference of Euler angles.
"""

from dataclasses import asdict, dataclass

import numpy as np

from calibration.errors import NotEnoughData, ShapeError
from calibration.numerics.lie import rotation_vector


@dataclass(frozen=True)
class PoseErrors:
    """Errors of n poses; rows with NaN are poses that could not be predicted or seen, all rotations where a point was.

    Attributes:
        position: (n, 3) [m, lab].
        rotation: (n, 3) rotation vectors [rad, lab].
    """

    position: np.ndarray
    rotation: np.ndarray

    def __len__(self) -> int:
        return len(self.position)

    @property
    def complete(self) -> "PoseErrors":
        """Without the rows that have NaN."""
        seen = np.isfinite(self.rotation).all(axis=1)
        good = np.isfinite(self.position).all(axis=1) & (seen | ~seen.any())
        return PoseErrors(self.position[good], self.rotation[good])


@dataclass(frozen=True)
class RowMetrics:
    """Figures of one row; names as in evaluation.json.

    Attributes:
        n: Poses compared.
        position_rmse_component_mm: [mm].
        position_rmse_norm_mm: [mm].
        position_p95_norm_mm: 95th percentile of the norm [mm].
        position_max_norm_mm: [mm].
        orientation_rmse_deg: Of the geodesic angle [deg].
        orientation_rmse_component_deg: [deg].
        orientation_max_deg: [deg].
        per_axis_mm: RMSE along lab x, y, z [mm].
    """

    n: int
    position_rmse_component_mm: float
    position_rmse_norm_mm: float
    position_p95_norm_mm: float
    position_max_norm_mm: float
    orientation_rmse_deg: float
    orientation_rmse_component_deg: float
    orientation_max_deg: float
    per_axis_mm: tuple[float, float, float]


def turned(metrics: RowMetrics) -> dict[str, float | None]:
    """Its figures of orientation by name, None where only a point was seen."""
    figures = {name: value for name, value in asdict(metrics).items() if name.startswith("orientation")}
    return {name: value if np.isfinite(value) else None for name, value in figures.items()}


def pose_errors(T_predicted: np.ndarray, T_reference: np.ndarray) -> PoseErrors:
    """Errors of predicted poses (n, 4, 4) against reference poses (n, 4, 4)."""
    if T_predicted.shape != T_reference.shape or T_predicted.shape[1:] != (4, 4):
        raise ShapeError("T_predicted", T_predicted.shape, T_reference.shape)
    turn = T_predicted[:, :3, :3] @ np.swapaxes(T_reference[:, :3, :3], 1, 2)
    return PoseErrors(T_predicted[:, :3, 3] - T_reference[:, :3, 3], rotation_vector(turn))


def dwell_means(t: np.ndarray, errors: PoseErrors, windows: np.ndarray) -> PoseErrors:
    """Mean error over each window (n, 2) [s] of samples at t [s]; NaN where a window has none."""
    means = np.full((len(windows), 6), np.nan)
    both = np.concatenate([errors.position, errors.rotation], axis=1)
    for k, (start, stop) in enumerate(windows):
        rows = both[(t >= start) & (t <= stop)]
        rows = rows[np.isfinite(rows).all(axis=1)]
        if len(rows):
            means[k] = rows.mean(axis=0)
    return PoseErrors(means[:, :3], means[:, 3:])


def row_metrics(errors: PoseErrors) -> RowMetrics:
    """Figures of a row from its errors.

    Raises:
        NotEnoughData: No pose could be compared.
    """
    good = errors.complete
    if len(good) == 0:
        raise NotEnoughData("no pose could be compared: predicted or measured hand poses are missing throughout")
    e, phi = 1e3 * good.position, np.degrees(good.rotation)
    norm, angle = np.linalg.norm(e, axis=1), np.linalg.norm(phi, axis=1)
    x, y, z = np.sqrt((e**2).mean(axis=0))
    return RowMetrics(
        len(good),
        _rms(e),
        _rms(norm),
        float(np.percentile(norm, 95.0)),
        float(norm.max()),
        _rms(angle),
        _rms(phi),
        float(angle.max()),
        (float(x), float(y), float(z)),
    )


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt((x**2).mean()))
