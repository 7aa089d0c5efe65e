"""Fit quality of the joint models on held-out trials; on the motions they were fitted to see `repetitions`.

unseen_motion   other motions: validation trials that move, while the joint moves, by the models of the estimate
static          mean over each dwell of validation trials: S = 1/2, not the side a stop left the gear on
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.recording.clock import Clock
from calibration.recording.trial import Trial
from calibration.stages.joints.correction import Corrected, JointModels, velocities
from calibration.stages.joints.repetitions import EXCITED, MOVING, Regime, RegimeQuality, quality_of
from calibration.stages.joints.samples import dwell_differences


@dataclass(frozen=True)
class TrialResiduals:
    """What the joint models leave of one trial.

    Attributes:
        regime: `unseen_motion` or `static`.
        joints: For each model (n, 3): discrepancy [rad], what is left of it [rad], whether it was outside the model's
            domain; empty where the trial does not excite the joint.
    """

    regime: Regime
    joints: tuple[np.ndarray, ...]


def residuals(models: JointModels, trial: Trial, corrected: Corrected, robot: Clock) -> TrialResiduals:
    """What the models leave of a trial whose corrected readings are known."""
    regime: Regime = "static" if len(trial.dwell_start) else "unseen_motion"
    sides = trial, replace(trial, q_motor=corrected.q), replace(trial, q_motor=trial.q_link + corrected.outside)
    if regime == "static":
        rows = np.array([list(dwell_differences(side, robot)) for side in sides])
        moves = np.ones(rows.shape[1:], dtype=bool)
    else:
        rows = np.array([side.q_motor - side.q_link for side in sides])
        moves = np.abs(velocities(trial.t_robot, trial.q_motor)) > MOVING
    return TrialResiduals(regime, tuple(_of_joint(models, m.joint, trial, rows, moves) for m in models.models))


def _of_joint(models: JointModels, joint: str, trial: Trial, rows: np.ndarray, moves: np.ndarray) -> np.ndarray:
    j = models.inputs.measured.index(joint)
    if np.ptp(trial.q_motor[:, j]) < EXCITED or not rows.size:
        return np.zeros((0, 3))
    found = rows[:, moves[:, j], j].T
    return np.asarray(found[np.isfinite(found).all(axis=1)] - np.array([1.0, 1.0, 0.0]) * models.zero[j])


def validation_qualities(models: JointModels | None, found: Sequence[TrialResiduals]) -> tuple[RegimeQuality, ...]:
    """Fit quality over validation trials: while moving (`unseen_motion`), and of their dwells (`static`)."""
    regimes: tuple[Regime, ...] = ("unseen_motion", "static")
    return () if models is None else tuple(q for regime in regimes for q in _pooled(models, regime, found))


def _pooled(models: JointModels, regime: Regime, found: Sequence[TrialResiduals]) -> Iterator[RegimeQuality]:
    for k, model in enumerate(models.models):
        rows = [one.joints[k] for one in found if one.regime == regime and len(one.joints[k])]
        if rows:
            y, e, outside = np.concatenate(rows).T
            yield quality_of(model.joint, regime, model.degree, y, e, outside)
