"""How much of the joints' discrepancy the printed model explains, from its own regime to where it fails.

    cut = 1 - rms(y - y_hat) / rms(y)             R2 = 1 - sum (y - y_hat)^2 / sum (y - mean y)^2
    repetition   the same motions again: the calibration trials that move the joint, in halves, each predicted by a
                 model of all other halves, as rich as they carry, while the joint moves
    unseen       other motions: validation trials that move, while the joint moves, by the models of the estimate
    static       mean over each dwell of validation trials: S = 1/2, the side a stop left the gear on is not predicted

y is motor minus link reading, the zero removed. A joint counts where it is excited: it moves by a tenth of a radian.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from calibration.clock import Clock
from calibration.joint_correction import JointModels, correct
from calibration.joint_inputs import velocities
from calibration.joint_model import Terms
from calibration.joint_samples import Samples, samples_of
from calibration.joint_selection import candidates
from calibration.joint_zero import dwell_differences
from calibration.recording import Trial

Regime = Literal["repetition", "unseen", "static"]
RICHEST = 8  # degree in the model's own regime
_EXCITED = 0.1  # [rad] range of a joint's motion
_MOVING = 0.02  # [rad/s]


@dataclass(frozen=True)
class Explained:
    """What the model of one joint explains in one regime.

    Attributes:
        joint: Name of the joint.
        regime: `repetition`, `unseen` or `static`.
        degree: Of the model; None where there is no correction.
        n: Samples or dwells.
        before: Rms of the discrepancy [rad].
        after: Rms of what is left [rad].
        r2: [-].
        outside: Share of samples outside the model's domain [-].
    """

    joint: str
    regime: Regime
    degree: int | None
    n: int
    before: float
    after: float
    r2: float
    outside: float

    @property
    def cut(self) -> float:
        """Share of the rms taken off [-]."""
        return 1.0 - self.after / max(self.before, np.finfo(float).tiny)


def on_repetitions(models: JointModels, trials: Sequence[Trial], terms: Terms) -> tuple[Explained, ...]:
    """What the model explains of motions it has seen, in repetitions it has not: moving calibration trials."""
    moving = [trial for trial in trials if not len(trial.dwell_start)]
    of_trials = [samples_of(models.inputs.of_trial(trial.id), trial, models.zero) for trial in moving]
    return tuple(
        found
        for joint, column in zip(models.inputs.measured, zip(*of_trials, strict=True), strict=True)
        if (found := _on_repetitions(joint, [s for s in column if s is not None], terms)) is not None
    )


def on_validation(models: JointModels, trials: Sequence[Trial], robot: Clock) -> tuple[Explained, ...]:
    """What the models explain of validation trials: while moving (`unseen`), and of their dwells (`static`)."""
    moving, still = ([t for t in trials if bool(len(t.dwell_start)) == rests] for rests in (False, True))
    return (*_on_others(models, "unseen", moving, robot), *_on_others(models, "static", still, robot))


def _on_repetitions(joint: str, samples: Sequence[Samples], terms: Terms) -> Explained | None:
    excited = [s for s in samples if np.ptp(s.theta) > _EXCITED]
    halves = [s.part(rows) for s in excited for rows in np.array_split(np.arange(len(s)), 2)]
    if not halves:
        return None
    best = min(candidates(halves, terms, RICHEST), key=lambda c: c.score)
    pairs = zip(halves, best.left_out, strict=True)
    y, e, speed = np.concatenate([[s.y, s.y - p, np.abs(s.velocity)] for s, p in pairs], axis=1)
    moves = speed > _MOVING
    return _explained(joint, "repetition", best.degree, y[moves], e[moves], np.zeros(moves.sum()))


def _on_others(models: JointModels, regime: Regime, trials: Sequence[Trial], robot: Clock) -> Iterator[Explained]:
    for model in models.models:
        j = models.inputs.measured.index(model.joint)
        found = [rows for trial in trials if len(rows := _errors(models, j, regime, trial, robot))]
        if found:
            y, e, outside = np.concatenate(found).T
            yield _explained(model.joint, regime, model.degree, y, e, outside)


def _errors(models: JointModels, j: int, regime: Regime, trial: Trial, robot: Clock) -> np.ndarray:
    """Discrepancy, what is left of it, whether it was outside the domain: (n, 3); empty where j is not excited."""
    corrected = correct(models.of_trial(trial.id), trial.t_robot, trial.q_motor)
    if np.ptp(trial.q_motor[:, j]) < _EXCITED:
        return np.zeros((0, 3))
    sides = trial, replace(trial, q_motor=corrected.q), replace(trial, q_motor=trial.q_link + corrected.outside)
    if regime == "static":
        rows = np.array([[d[j] for d in dwell_differences(side, robot)] for side in sides]).T
    else:
        moves = np.abs(velocities(trial.t_robot, trial.q_motor)[:, j]) > _MOVING
        rows = np.stack([(side.q_motor - side.q_link)[moves, j] for side in sides], axis=1)
    return rows[np.isfinite(rows).all(axis=1)] - np.array([1.0, 1.0, 0.0]) * models.zero[j]


def _explained(
    joint: str, regime: Regime, degree: int | None, y: np.ndarray, e: np.ndarray, outside: np.ndarray
) -> Explained:
    before, after = (float(np.sqrt((x**2).mean())) for x in (y, e))
    total = max(float(((y - y.mean()) ** 2).sum()), np.finfo(float).tiny)
    return Explained(joint, regime, degree, len(y), before, after, 1.0 - float(e @ e) / total, float(outside.mean()))
