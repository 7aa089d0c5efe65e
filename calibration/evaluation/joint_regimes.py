"""How much of the joints' discrepancy the printed model explains, from its own regime to where it fails.

    cut = 1 - rms(y - y_hat) / rms(y)             R2 = 1 - sum (y - y_hat)^2 / sum (y - mean y)^2
    repetition      the same motion again: calibration trials that excite the joint, settled, in halves, each predicted
                    by a model of all other halves, as rich as they carry, while the joint moves
    start_stop      by the same model: starts and stops of those trials, which happen once and are no repetition
    unseen_motion   other motions: validation trials that move, while the joint moves, by the models of the estimate
    static          mean over each dwell of validation trials: S = 1/2, not the side a stop left the gear on

y is motor minus link reading, the zero removed. Settled is from 1.5 s after the joint began to move to 0.3 s before it
stops: a velocity step of 0.1 s makes base and torso ring near 2 Hz and throws the gear from flank to flank against the
sign of its velocity. A joint is excited where it moves by a tenth of a radian, both halves run on both flanks for a
second, and its discrepancy is ten times the noise of a reading.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from calibration.options import Terms
from calibration.recording.clock import Clock
from calibration.recording.trial import Trial
from calibration.stages.joints.correction import JointModels, correct, velocities
from calibration.stages.joints.degree_selection import candidates, fit_joint
from calibration.stages.joints.samples import Samples, dwell_differences, pooled, samples_of

Regime = Literal["repetition", "start_stop", "unseen_motion", "static"]
RICHEST = 8  # degree in the model's own regime
_EXCITED = 0.1  # [rad] range of a joint's motion
_MOVING = 0.02  # [rad/s]
_STARTED, _STOPPING = 1.5, 0.3  # [s] after the first and before the last sample that moves
_ON_EACH_FLANK = 1.0  # [s]
_OVER_NOISE = 10.0  # discrepancy over the noise of a reading [-]


@dataclass(frozen=True)
class RegimeQuality:
    """What the model of one joint explains in one regime.

    Attributes:
        joint: Name of the joint.
        regime: `repetition`, `start_stop`, `unseen_motion` or `static`.
        degree: Of the model; None where there is no correction.
        n: Samples or dwells.
        before: Rms of the discrepancy [rad].
        after: Rms of what is left [rad].
        r2: [-].
        outside: Share of them outside the model's domain [-].
    """

    joint: str
    regime: Regime
    degree: int | None
    n: int
    before: float
    after: float
    r2: float
    outside: float

    def entry(self) -> dict[str, str | int | float | None]:
        """A row of `regimes` in evaluation.json."""
        return {
            "joint": self.joint,
            "regime": self.regime,
            "degree": self.degree,
            "n": self.n,
            "discrepancy_before_mrad": 1e3 * self.before,
            "discrepancy_after_mrad": 1e3 * self.after,
            "cut_percent": 100.0 * self.cut,
            "r2": self.r2,
            "outside_percent": 100.0 * self.outside,
        }

    @property
    def cut(self) -> float:
        """Share of the rms taken off [-]."""
        return 1.0 - self.after / max(self.before, np.finfo(float).tiny)


def on_repetitions(models: JointModels, trials: Iterable[Trial], terms: Terms) -> tuple[RegimeQuality, ...]:
    """What the model explains of motions it has seen, in repetitions it has not: moving calibration trials."""
    moving = (trial for trial in trials if not len(trial.dwell_start))
    of_trials = [samples_of(models.inputs.of_trial(trial.id), trial, models.zero) for trial in moving]
    if not of_trials:
        return ()
    noise = models.inputs.lab.description.sigmas.encoder
    columns = zip(models.inputs.measured, models.zero, zip(*of_trials, strict=True), strict=True)
    return tuple(
        found
        for joint, zero, column in columns
        for found in _on_repetitions(joint, float(zero), [s for s in column if s is not None], terms, noise)
    )


def on_validation(models: JointModels, trials: Iterable[Trial], robot: Clock) -> tuple[RegimeQuality, ...]:
    """What the models explain of validation trials: while moving (`unseen_motion`), and of their dwells (`static`)."""
    moving: list[Trial] = []
    still: list[Trial] = []
    for trial in trials:
        (still if len(trial.dwell_start) else moving).append(trial)
    return (*_on_others(models, "unseen_motion", moving, robot), *_on_others(models, "static", still, robot))


def _on_repetitions(
    joint: str, zero: float, samples: Sequence[Samples], terms: Terms, noise: float
) -> Iterator[RegimeQuality]:
    excited = [s for s in samples if _visits_both_flanks(s)]
    halves = [half for s in excited for half in _halves(s)]
    if not halves or np.sqrt((pooled(halves).y ** 2).mean()) < _OVER_NOISE * noise:
        return
    best = min(candidates(halves, terms, RICHEST), key=lambda c: c.score)
    whole = pooled(halves)
    moves = np.abs(whole.velocity) > _MOVING
    e = (whole.y - np.concatenate(best.left_out))[moves]
    yield _quality(joint, "repetition", best.degree, whole.y[moves], e, np.zeros(len(e)))
    model = fit_joint(joint, halves, zero, terms, best)
    if model.degree is None:
        return
    ends = pooled([_ends(s) for s in excited])
    e = ends.y - model.discrepancy(ends.theta, ends.tau, ends.velocity)
    yield _quality(joint, "start_stop", model.degree, ends.y, e, model.is_outside(ends.theta, ends.tau))


def _visits_both_flanks(samples: Samples) -> bool:
    """Whether the joint moves, in both halves of the trial's settled part with either sign for long enough."""
    if len(samples) < 2 or np.ptp(samples.theta) < _EXCITED:
        return False
    enough = _ON_EACH_FLANK / float(np.median(np.diff(samples.t)))
    signs = [sign * half.velocity > _MOVING for half in _halves(samples) for sign in (1.0, -1.0)]
    return all(of_one.sum() >= enough for of_one in signs)


def _settled(samples: Samples) -> np.ndarray:
    """Samples (n,) after the start and before the stop of the joint's motion."""
    t = samples.t[np.abs(samples.velocity) > _MOVING]
    return (samples.t >= t[0] + _STARTED) & (samples.t <= t[-1] - _STOPPING)


def _halves(samples: Samples) -> list[Samples]:
    return [samples.part(rows) for rows in np.array_split(np.flatnonzero(_settled(samples)), 2)]


def _ends(samples: Samples) -> Samples:
    """Samples of the start, and of the stop until as long after it."""
    t = samples.t[np.abs(samples.velocity) > _MOVING]
    near = (samples.t >= t[0]) & (samples.t <= t[-1] + _STARTED)
    return samples.part(near & ~_settled(samples))


def _on_others(models: JointModels, regime: Regime, trials: Sequence[Trial], robot: Clock) -> Iterator[RegimeQuality]:
    for model in models.models:
        j = models.inputs.measured.index(model.joint)
        found = [rows for trial in trials if len(rows := _errors(models, j, regime, trial, robot))]
        if found:
            y, e, outside = np.concatenate(found).T
            yield _quality(model.joint, regime, model.degree, y, e, outside)


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


def _quality(
    joint: str, regime: Regime, degree: int | None, y: np.ndarray, e: np.ndarray, outside: np.ndarray
) -> RegimeQuality:
    before, after = (float(np.sqrt((x**2).mean())) for x in (y, e))
    total = max(float(((y - y.mean()) ** 2).sum()), np.finfo(float).tiny)
    return RegimeQuality(
        joint, regime, degree, len(y), before, after, 1.0 - float(e @ e) / total, float(outside.mean())
    )
