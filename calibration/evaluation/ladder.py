"""Rows of the ladder: each model's errors over trials, pooled into figures."""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from calibration.evaluation.pose_errors import PoseErrors, RowMetrics, dwell_means, pose_errors, row_metrics, turned
from calibration.prediction.predicted_trial import Prediction
from calibration.prediction.predictor import REFERENCE

Trials = Literal["dynamic", "static", "all"]


@dataclass(frozen=True)
class TrialErrors:
    """Errors of one row in one trial.

    Attributes:
        model: Row of the ladder.
        base: `fixed` or `measured`.
        encoder: `motor`.
        trial_id: The trial.
        kind: Its kind.
        t: (n,) [s, mocap clock].
        errors: n poses over time, NaN where nothing can be compared.
        scored: The errors that count: dwell means of a static trial, else the samples after the first second.
    """

    model: str
    base: str
    encoder: str
    trial_id: str
    kind: str
    t: np.ndarray
    errors: PoseErrors
    scored: PoseErrors


@dataclass(frozen=True)
class Row:
    """One line of the ladder."""

    model: str
    trials: Trials
    base: str
    encoder: str
    against: str
    metrics: RowMetrics

    def entry(self) -> dict[str, Any]:
        """As evaluation.json and score.json have it."""
        figures = asdict(self.metrics) | turned(self.metrics)
        figures["per_axis_mm"] = dict(zip("xyz", self.metrics.per_axis_mm, strict=True))
        names = {"model": self.model, "trials": self.trials, "base": self.base, "encoder": self.encoder}
        return names | {"against": self.against} | figures


def scored_errors(t: np.ndarray, errors: PoseErrors, dwells: np.ndarray, static: bool) -> PoseErrors:
    """The errors at t (n,) [s, mocap clock] that count; dwells (k, 2) [s] of a static trial."""
    if static:
        return dwell_means(t, errors, dwells)
    after = t > t[0] + REFERENCE
    return PoseErrors(errors.position[after], errors.rotation[after])


def trial_errors(p: Prediction, T_reference: np.ndarray, dwells: np.ndarray) -> TrialErrors:
    """Errors of a prediction against reference poses (n, 4, 4); dwells (k, 2) [s] of a static trial."""
    e = pose_errors(p.T_lab_hand, T_reference)
    scored = scored_errors(p.t, e, dwells, p.kind == "static")
    return TrialErrors(p.model, p.base, p.encoder, p.trial_id, p.kind, p.t, e, scored)


def ladder(traces: list[TrialErrors], against: str) -> Iterator[Row]:
    """Rows of dynamic, static and all trials, in the traces' order of models."""
    keys = dict.fromkeys((t.model, t.base, t.encoder) for t in traces)
    groups: tuple[tuple[Trials, Callable[[TrialErrors], bool]], ...] = (
        ("dynamic", lambda t: t.kind != "static"),
        ("static", lambda t: t.kind == "static"),
        ("all", lambda t: True),
    )
    for model, base, encoder in keys:
        mine = [t for t in traces if (t.model, t.base, t.encoder) == (model, base, encoder)]
        for name, belongs in groups:
            parts = [t.scored for t in mine if belongs(t)]
            if parts:
                errors = PoseErrors(
                    np.concatenate([p.position for p in parts]), np.concatenate([p.rotation for p in parts])
                )
                yield Row(model, name, base, encoder, against, row_metrics(errors))


def trial_entry(trace: TrialErrors) -> dict[str, Any]:
    """One row in one trial: where a row is good and where it is not."""
    m = row_metrics(trace.scored)
    return {
        "trial": trace.trial_id,
        "model": trace.model,
        "base": trace.base,
        "encoder": trace.encoder,
        "n": m.n,
        "position_rmse_component_mm": m.position_rmse_component_mm,
        "orientation_rmse_deg": turned(m)["orientation_rmse_deg"],
    }
