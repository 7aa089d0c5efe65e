"""How well the suspension predicts the base's roll and pitch, against the truth of the held-out moving trials.

    R2_a = 1 - sum (x_hat - x)_a^2 / sum (x - mean x)_a^2        x = log(R(0)' R(t)), all trials together

R of the true base, and as predicted from the first second at rest and a wrench: no marker later than that, no noise.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from calibration import Dataset, Estimate
from calibration.mocap import relabelled_trial
from calibration.prediction.base_pose import base_poses
from calibration.stages.suspension import Source, Suspension, laboratory
from twin import truth


@dataclass(frozen=True)
class BaseScore:
    """R2 of the base's roll and pitch as predicted from one source of the wrench, over n samples."""

    source: Source
    n: int
    roll_r2: float
    pitch_r2: float


def base_scores(estimate: Estimate, dataset: Dataset, truth_folder: Path) -> tuple[BaseScore, ...]:
    """One for each source of the wrench that the suspension was tried with; none without a suspension or swings."""
    suspension = estimate.suspension
    swings = dataset.entries("validation", "swing")
    if suspension is None or not swings:
        return ()
    data = estimate, dataset, truth_folder
    return tuple(_score(source, list(_angles(suspension, source, *data))) for source, _ in suspension.held_out)


def _score(source: Source, pairs: Sequence[tuple[np.ndarray, np.ndarray]]) -> BaseScore:
    true, found = (np.concatenate(x) for x in zip(*pairs, strict=True))
    left = ((found - true) ** 2).sum(axis=0) / ((true - true.mean(axis=0)) ** 2).sum(axis=0)
    return BaseScore(source, len(true), *(float(1.0 - x) for x in left[:2]))


def _angles(
    suspension: Suspension, source: Source, estimate: Estimate, dataset: Dataset, truth_folder: Path
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """True and predicted rotation vectors (n, 3) [rad] since the start of each trial."""
    for entry in dataset.entries("validation", "swing"):
        description = dataset.description.loaded(entry)
        lab = laboratory(dataset.urdf, description, estimate.clock("robot"), estimate.clock("plate"))
        true = truth.read_trial(truth_folder / entry.file).base_pose
        found = base_poses(suspension, lab, relabelled_trial(dataset, entry), source)
        yield _turned(true), _turned(found)


def _turned(T: np.ndarray) -> np.ndarray:
    return np.asarray(Rotation.from_matrix(T[0, :3, :3].T @ T[:, :3, :3]).as_rotvec())
