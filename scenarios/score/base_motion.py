"""How well the suspension predicts the base's roll and pitch, against the truth of the held-out moving trials.

    R2_a = 1 - sum (x_hat - x)_a^2 / sum (x - mean x)_a^2        x = log(R(0)' R(t)), all trials together

R of the true base, and as predicted from the first second at rest and a wrench: no marker later than that, no noise.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from calibration.prediction import PredictedTrial
from calibration.stages.suspension import Source
from twin.truth import TruthTrial


@dataclass(frozen=True)
class BaseScore:
    """R2 of the base's roll and pitch as predicted from one source of the wrench, over n samples."""

    source: Source
    n: int
    roll_r2: float
    pitch_r2: float


def base_scores(trials: Iterable[tuple[PredictedTrial, TruthTrial]]) -> tuple[BaseScore, ...]:
    """One for each source of the wrench that the suspension was tried with; none without a suspension or swings."""
    pairs: dict[Source, list[tuple[np.ndarray, np.ndarray]]] = {}
    for trial, true in trials:
        base = trial.base
        if trial.kind == "swing" and base is not None and base.rest is not None:
            for source, x in base.predicted:
                pairs.setdefault(source, []).append((_turned(true.base_pose), _turned(base.rest.poses(x))))
    return tuple(_score(source, found) for source, found in pairs.items())


def _score(source: Source, pairs: Sequence[tuple[np.ndarray, np.ndarray]]) -> BaseScore:
    true, found = (np.concatenate(x) for x in zip(*pairs, strict=True))
    left = ((found - true) ** 2).sum(axis=0) / ((true - true.mean(axis=0)) ** 2).sum(axis=0)
    return BaseScore(source, len(true), *(float(1.0 - x) for x in left[:2]))


def _turned(T: np.ndarray) -> np.ndarray:
    return np.asarray(Rotation.from_matrix(T[0, :3, :3].T @ T[:, :3, :3]).as_rotvec())
