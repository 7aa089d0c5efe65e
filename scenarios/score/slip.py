"""What the slipping base alone does to the hand in trials kept aside, joints and all else true.

    e = (M - I) p_hand(t)           M = predicted times true T_lab_base^-1, from the true base at first
    var e = A V A',   A = [I, -[r]x],   V = diag of the base's variances in frame 0,   r from frame 0 to the hand

The share of |e_i| <= 1.96 sigma_i is what the 95 % band holds. Slips are counted since the first second, which is the
only reference: each time one more wheel begins to slide. In a static trial the means of its postures are counted.
"""

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from calibration.evaluation import trial_errors
from calibration.numerics.lie import inverse, mean
from calibration.prediction import PredictedTrial, Prediction
from calibration.stages.stick_slip import BasePrediction
from calibration.stages.suspension import REST, Source
from twin.truth import TruthTrial

_TWO_SIDED = 1.96
_SLIDES = 0.999  # of a wheel's friction
_SLIPS = (0, 10, 100)  # since the reference, lower ends of the groups


@dataclass(frozen=True)
class Errors:
    """Error of the hand by the base alone, n samples that count.

    Attributes:
        predicted: (n, 3) [m].
        still: (n, 3) of a base that stays [m].
        compliance: (n, 3) of a base on the 6x6 compliance alone [m]; NaN where it was not predicted.
        sigma: (n, 3) standard deviation that is claimed of `predicted` [m].
        slips: (n,) since the first second.
    """

    predicted: np.ndarray
    still: np.ndarray
    compliance: np.ndarray
    sigma: np.ndarray
    slips: np.ndarray

    def entry(self, rows: np.ndarray) -> dict[str, float | int | None]:
        """Figures of some of the samples."""
        p, still, sigma = self.predicted[rows], self.still[rows], self.sigma[rows]
        inside = float((np.abs(p) <= _TWO_SIDED * sigma).mean())
        beside = {"still_mm": _mm(still), "compliance_mm": _mm(self.compliance[rows])}
        return {"n": len(p), "hand_mm": _mm(p) or 0.0} | beside | {"sigma_mm": _mm(sigma), "inside_95": inside}


@dataclass(frozen=True)
class SlipScore:
    """One trial by one source of the wrench.

    Attributes:
        trial: Its name.
        kind: static or swing.
        source: Of the wrench.
        predictable: Whether the band says so of yaw.
        yaw_r2: 1 - sum (predicted - true)^2 / sum (true - its mean)^2 after the first second [-].
        errors: Of the hand.
    """

    trial: str
    kind: str
    source: Source
    predictable: bool
    yaw_r2: float
    errors: Errors

    def entry(self) -> dict[str, object]:
        """As in score.json."""
        found = asdict(self)
        errors = self.errors
        found.pop("errors")
        group = np.searchsorted(_SLIPS, errors.slips, side="right") - 1
        by_slips = [{"slips_from": s, **errors.entry(group == k)} for k, s in enumerate(_SLIPS) if (group == k).any()]
        whole = errors.entry(np.ones(len(group), dtype=bool))
        return found | whole | {"by_slips": by_slips}


def slip_scores(trials: Iterable[tuple[PredictedTrial, TruthTrial]]) -> Iterator[SlipScore]:
    """Each trial by each source; none without a base that slips."""
    for trial, true in trials:
        for source, found in trial.base.slipped if trial.base is not None else ():
            yield _score(trial, true, source, found)


def _score(trial: PredictedTrial, true: TruthTrial, source: Source, found: BasePrediction) -> SlipScore:
    early = trial.t <= trial.t[0] + REST
    at_rest = mean(true.base_pose[early])
    base = _moved(found.T_lab_B, early, at_rest)
    hand_in_base, hand = inverse(true.base_pose) @ true.hand_pose, true.hand_pose[:, :3, 3]
    every = base, np.broadcast_to(at_rest, base.shape), _on_compliance(trial, source, early, at_rest)
    errors = [(T @ hand_in_base)[:, :3, 3] - hand for T in every]
    motion = found.motion
    sigma = np.sqrt(_carried(motion.variance, at_rest, hand))
    sliding = (motion.use > _SLIDES).astype(int)
    slips = np.cumsum((np.diff(sliding, axis=0, prepend=sliding[:1]) > 0).sum(axis=1))
    columns = [*errors, sigma, np.repeat(slips[:, None], 3, axis=1)]
    kept = [_counted(trial, c) for c in columns]
    seen = np.isfinite(np.concatenate([kept[0], *kept[3:]], axis=1)).all(axis=1)
    predicted, still, compliance, spread, count = (c[seen] for c in kept)
    yaw, own = (_yaw(T)[~early] for T in (base, true.base_pose))
    moved = max(float(((own - own.mean()) ** 2).sum()), np.finfo(float).tiny)
    r2 = 1.0 - float(((yaw - own) ** 2).sum()) / moved
    errors_found = Errors(predicted, still, compliance, spread, count[:, 0])
    return SlipScore(trial.trial_id, trial.kind, source, motion.predictable, r2, errors_found)


def _moved(T: np.ndarray, early: np.ndarray, at_rest: np.ndarray) -> np.ndarray:
    """T_lab_base (n, 4, 4) from at_rest (4, 4) on, moved as a body at T (n, 4, 4) moves."""
    return np.asarray(T @ inverse(mean(T[early])) @ at_rest)


def _on_compliance(trial: PredictedTrial, source: Source, early: np.ndarray, at_rest: np.ndarray) -> np.ndarray:
    x = dict(trial.base.predicted).get(source) if trial.base is not None else None
    if x is None or trial.base is None or trial.base.rest is None:
        return np.full((len(trial.t), 4, 4), np.nan)
    return _moved(trial.base.rest.poses(x), early, at_rest)


def _counted(trial: PredictedTrial, x: np.ndarray) -> np.ndarray:
    """Rows (m, 3) of x (n, 3) that a row of the ladder counts: after the first second, or means of postures."""
    T, zero = np.tile(np.eye(4), (2, len(x), 1, 1))
    T[:, :3, 3] = x
    found = Prediction("", "fixed", "motor", trial.trial_id, trial.kind, trial.t, T)
    return trial_errors(found, zero, trial.dwells).scored.position


def _carried(variance: np.ndarray, T_lab_0: np.ndarray, hand: np.ndarray) -> np.ndarray:
    """Variances (n, 3) of the hand's place along the lab's axes, by those (n, 6) of the base in frame 0."""
    R, r = T_lab_0[:3, :3], (hand - T_lab_0[:3, 3]) @ T_lab_0[:3, :3]
    A = np.zeros((len(r), 3, 6))
    A[:, :, :3] = np.eye(3)
    for k in range(3):
        A[:, :, 3 + k] = np.cross(np.eye(3)[k], r)
    return np.asarray(((R @ A) ** 2 @ variance[..., None])[..., 0])


def _yaw(T: np.ndarray) -> np.ndarray:
    return np.asarray(Rotation.from_matrix(T[0, :3, :3].T @ T[:, :3, :3]).as_rotvec()[:, 2])


def _mm(x: np.ndarray) -> float | None:
    return 1e3 * float(np.sqrt((x**2).mean())) if np.isfinite(x).all() else None
