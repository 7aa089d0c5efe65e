"""Fit quality of the joint models by motion regime, and in their own: repetitions of the calibration's motions.

    cut = 1 - rms(y - y_hat) / rms(y)             R2 = 1 - sum (y - y_hat)^2 / sum (y - mean y)^2
    repetition      the same motion again: calibration trials that excite the joint, settled, in halves, each predicted
                    by a model of all other halves, as rich as they carry, while the joint moves
    start_stop      by the same model: starts and stops of those trials, which happen once and are no repetition

y is motor minus link reading, the zero removed. Settled is from 1.5 s after the joint began to move to 0.3 s before it
stops: a velocity step of 0.1 s makes base and torso ring near 2 Hz and throws the gear from flank to flank against the
sign of its velocity. A joint is excited where it moves by a tenth of a radian, both halves run on both flanks for a
second, and its discrepancy is ten times the noise of a reading.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from calibration.numerics.side_by_side import side_by_side
from calibration.options import Terms
from calibration.recording.trial import Trial
from calibration.stages.joints.correction import JointModels
from calibration.stages.joints.degree_selection import candidates, fit_joint
from calibration.stages.joints.samples import Samples, pooled, samples_of

Regime = Literal["repetition", "start_stop", "unseen_motion", "static"]
RICHEST = 8  # degree in the model's own regime
EXCITED = 0.1  # [rad] range of a joint's motion
MOVING = 0.02  # [rad/s]
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

    def found(joint: str, zero: float, column: Sequence[Samples | None]) -> list[RegimeQuality]:
        return [*_on_repetitions(joint, float(zero), [s for s in column if s is not None], terms, noise)]

    of_joints = side_by_side(found, models.inputs.measured, models.zero, zip(*of_trials, strict=True))
    return tuple(quality for of_joint in of_joints for quality in of_joint)


def _on_repetitions(
    joint: str, zero: float, samples: Sequence[Samples], terms: Terms, noise: float
) -> Iterator[RegimeQuality]:
    excited = [s for s in samples if _visits_both_flanks(s)]
    halves = [half for s in excited for half in _halves(s)]
    if not halves or np.sqrt((pooled(halves).y ** 2).mean()) < _OVER_NOISE * noise:
        return
    best = min(candidates(halves, terms, RICHEST), key=lambda c: c.score)
    whole = pooled(halves)
    moves = np.abs(whole.velocity) > MOVING
    e = (whole.y - np.concatenate(best.left_out))[moves]
    yield quality_of(joint, "repetition", best.degree, whole.y[moves], e, np.zeros(len(e)))
    model = fit_joint(joint, halves, zero, terms, best)
    if model.degree is None:
        return
    ends = pooled([_ends(s) for s in excited])
    e = ends.y - model.discrepancy(ends.theta, ends.tau, ends.velocity)
    yield quality_of(joint, "start_stop", model.degree, ends.y, e, model.is_outside(ends.theta, ends.tau))


def _visits_both_flanks(samples: Samples) -> bool:
    """Whether the joint moves, in both halves of the trial's settled part with either sign for long enough."""
    if len(samples) < 2 or np.ptp(samples.theta) < EXCITED:
        return False
    enough = _ON_EACH_FLANK / float(np.median(np.diff(samples.t)))
    signs = [sign * half.velocity > MOVING for half in _halves(samples) for sign in (1.0, -1.0)]
    return all(of_one.sum() >= enough for of_one in signs)


def _settled(samples: Samples) -> np.ndarray:
    """Samples (n,) after the start and before the stop of the joint's motion."""
    t = samples.t[np.abs(samples.velocity) > MOVING]
    return (samples.t >= t[0] + _STARTED) & (samples.t <= t[-1] - _STOPPING)


def _halves(samples: Samples) -> list[Samples]:
    return [samples.part(rows) for rows in np.array_split(np.flatnonzero(_settled(samples)), 2)]


def _ends(samples: Samples) -> Samples:
    """Samples of the start, and of the stop until as long after it."""
    t = samples.t[np.abs(samples.velocity) > MOVING]
    near = (samples.t >= t[0]) & (samples.t <= t[-1] + _STARTED)
    return samples.part(near & ~_settled(samples))


def quality_of(
    joint: str, regime: Regime, degree: int | None, y: np.ndarray, e: np.ndarray, outside: np.ndarray
) -> RegimeQuality:
    """Figures of n samples: y (n,) and what the model leaves, e (n,) [rad], whether each was outside its domain."""
    before, after = (float(np.sqrt((x**2).mean())) for x in (y, e))
    total = max(float(((y - y.mean()) ** 2).sum()), np.finfo(float).tiny)
    return RegimeQuality(
        joint, regime, degree, len(y), before, after, 1.0 - float(e @ e) / total, float(outside.mean())
    )
