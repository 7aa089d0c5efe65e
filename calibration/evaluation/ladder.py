"""Rows of the ladder: each model's errors over trials, pooled into figures."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from calibration.evaluation.pose_errors import PoseErrors, RowMetrics, dwell_means, pose_errors, row_metrics, turned
from calibration.prediction.predicted_trial import Prediction
from calibration.recording.trial import REST
from calibration.robot.hand_uncertainty import radius_95

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
        radius: (m,) within which 95 % of the scored errors are promised to be [m]; None where the row promises nothing.
    """

    model: str
    base: str
    encoder: str
    trial_id: str
    kind: str
    t: np.ndarray
    errors: PoseErrors
    scored: PoseErrors
    radius: np.ndarray | None = None


@dataclass(frozen=True)
class Row:
    """One line of the ladder.

    `inside_95` is the share of the scored errors within the radius promised for 95 % of them [-], `band_95_mm` its
    median [mm]; None where the row promises nothing.
    """

    model: str
    trials: Trials
    base: str
    encoder: str
    against: str
    metrics: RowMetrics
    inside_95: float | None = None
    band_95_mm: float | None = None

    def entry(self) -> dict[str, Any]:
        """As evaluation.json and score.json have it."""
        figures = asdict(self.metrics) | turned(self.metrics)
        figures["per_axis_mm"] = dict(zip("xyz", self.metrics.per_axis_mm, strict=True))
        names = {"model": self.model, "trials": self.trials, "base": self.base, "encoder": self.encoder}
        promised = {"inside_95": self.inside_95, "band_95_mm": self.band_95_mm}
        return names | {"against": self.against} | figures | promised


def scored_errors(t: np.ndarray, errors: PoseErrors, dwells: np.ndarray, static: bool) -> PoseErrors:
    """The errors at t (n,) [s, mocap clock] that count; dwells (k, 2) [s] of a static trial."""
    if static:
        return dwell_means(t, errors, dwells)
    return PoseErrors(_after(t, errors.position), _after(t, errors.rotation))


def trial_errors(
    p: Prediction, T_reference: np.ndarray, dwells: np.ndarray, noise: np.ndarray | None = None
) -> TrialErrors:
    """Errors of a prediction against reference poses (n, 4, 4) with `noise` (n, 3, 3) of their places [m2, lab].

    A static trial's are means over dwells (k, 2) [s], as is its band; white noise of samples is not in a mean.
    """
    e, static = pose_errors(p.T_lab_hand, T_reference), p.kind == "static"
    scored, radius = scored_errors(p.t, e, dwells, static), None
    if p.covariance is not None:
        radius = radius_95(p.covariance if static or noise is None else p.covariance + noise, p.offset)
        radius = (
            np.array([_mean(radius[(p.t >= a) & (p.t <= b)]) for a, b in dwells]) if static else _after(p.t, radius)
        )
    return TrialErrors(p.model, p.base, p.encoder, p.trial_id, p.kind, p.t, e, scored, radius)


def _after(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Samples that count of a trial that moves."""
    return np.asarray(x[t > t[0] + REST])


def _mean(x: np.ndarray) -> float:
    known = x[np.isfinite(x)]
    return float(known.mean()) if len(known) else np.nan


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
            counted = [t for t in mine if belongs(t)]
            if counted:
                errors = PoseErrors(
                    *(np.concatenate([getattr(t.scored, name) for t in counted]) for name in ("position", "rotation"))
                )
                yield Row(model, name, base, encoder, against, row_metrics(errors), *_inside(counted))


def _inside(traces: Sequence[TrialErrors]) -> tuple[float | None, float | None]:
    """Share of scored errors within their radius [-], and its median [mm]; None where a trial has none."""
    if any(t.radius is None for t in traces):
        return None, None
    e = np.linalg.norm(np.concatenate([t.scored.position for t in traces]), axis=1)
    radius = np.concatenate([t.radius for t in traces if t.radius is not None])
    known = np.isfinite(e) & np.isfinite(radius)
    if not known.any():
        return None, None
    return float((e[known] <= radius[known]).mean()), 1e3 * float(np.median(radius[known]))


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
