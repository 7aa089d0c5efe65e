"""Score every model's held-out predictions against the motion capture.

Dynamic trials sample by sample, static ones by the mean error over each dwell; `all` is both together. A trial's first
second is the base's reference and is not scored. The reference is the hand cluster's measured pose: its own noise
counts.
"""

import json
import os
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from calibration import netcdf
from calibration.bodies import poses_of
from calibration.comparison import comparisons
from calibration.dataset import Dataset
from calibration.errors import NotEnoughData
from calibration.estimate import Estimate
from calibration.evaluation_checks import moved_in_trials, no_better
from calibration.joint_regimes import Explained, on_repetitions, on_validation
from calibration.markers import hand_body
from calibration.means import PostureMeans
from calibration.metrics import PoseErrors, RowMetrics, dwell_means, pose_errors, row_metrics, turned
from calibration.point_body import is_point, places, point_of
from calibration.point_rows import PointRow, point_rows
from calibration.postures import dwell_windows
from calibration.predict import REFERENCE, Prediction, Predictor, predictor
from calibration.protocols import protocol_rows
from calibration.recording import Trial
from calibration.reregistration import registration_trials, reregistered
from calibration.schema import Body, Role, TrialEntry
from calibration.verdict import Verdict

Trials = Literal["dynamic", "static", "all"]


@dataclass(frozen=True)
class Trace:
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


@dataclass(frozen=True)
class Evaluation:
    """The ladder, the errors it is made of, and what the joint models explain of each joint's discrepancy.

    `confirmation` is the ladder of another session, its marker bodies registered anew; empty where there is none.
    `verdicts` name trials whose errors are not the model's.
    `points` are single markers of trials that hold posture means.
    """

    rows: tuple[Row, ...]
    traces: tuple[Trace, ...]
    regimes: tuple[Explained, ...] = ()
    confirmation: tuple[Row, ...] = ()
    verdicts: tuple[Verdict, ...] = ()
    points: tuple[PointRow, ...] = ()

    def row(self, model: str, trials: Trials = "dynamic", base: str = "fixed", encoder: str = "motor") -> Row:
        """One line.

        Raises:
            NotEnoughData: There is no such line.
        """
        wanted = (model, trials, base, encoder)
        for row in self.rows:
            if (row.model, row.trials, row.base, row.encoder) == wanted:
                return row
        raise NotEnoughData(f"no row {wanted}; there are {[(r.model, r.trials, r.base, r.encoder) for r in self.rows]}")

    def save(self, folder: Path | str) -> None:
        """Write evaluation.json and evaluation.nc into a folder, made where it is missing."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        part = folder / "evaluation.json.part"
        compared = tuple(comparisons(self.traces))
        content = {
            "schema": 1,
            "rows": [row_entry(r) for r in self.rows],
            "confirmation": [row_entry(r) | {"role": "confirmation"} for r in self.confirmation],
            "points": [asdict(p) for p in self.points],
            "trials": [trial_entry(t) for t in self.traces],
            "protocols": [asdict(r) for r in protocol_rows(self.traces, self.rows)],
            "regimes": [x.entry() for x in self.regimes],
            "verdicts": [asdict(v) for v in (*self.verdicts, *no_better(compared))],
            "comparisons": [asdict(c) for c in compared],
        }
        part.write_text(json.dumps(content, indent=1) + "\n", "utf-8")
        os.replace(part, folder / "evaluation.json")
        _write_traces(folder / "evaluation.nc", self.traces)


def evaluate(
    estimate: Estimate,
    dataset: Dataset,
    progress: Callable[[str, float], None] | None = None,
    role: Role = "validation",
) -> Evaluation:
    """Score an estimate on the trials of a role.

    Raises:
        NotEnoughData: There is no trial of that role.
        NotCalibrated: The estimate must not be used.
    """
    entries = dataset.entries(role)
    if not entries:
        raise NotEnoughData(f"no {role} trial to score on")
    predict = predictor(estimate, dataset)
    traces = _traces(predict, dataset, entries, progress)
    registering = registration_trials(dataset) if role == "validation" else ()
    confirmed: list[Trace] = []
    if registering:
        later = tuple(e for e in dataset.entries("confirmation") if e not in registering)
        confirmed = _traces(reregistered(predict, dataset), dataset, later, progress)
    if progress is not None:
        progress("joint models", 1.0)
    rows, confirmation = tuple(ladder(traces, "mocap")), tuple(ladder(confirmed, "mocap"))
    moved = tuple(moved_in_trials(dataset.description, dataset.trials(role)))
    points = point_rows(estimate, dataset, role)
    return Evaluation(rows, tuple(traces), regimes(predict, dataset, role), confirmation, moved, points)


def _traces(
    predict: Predictor,
    dataset: Dataset,
    entries: tuple[TrialEntry, ...],
    progress: Callable[[str, float], None] | None,
) -> list[Trace]:
    """Errors of every row in each of these trials."""
    body, traces = hand_body(dataset.description), []
    for k, entry in enumerate(entries):
        if progress is not None:
            progress(f"evaluating {entry.id}", k / len(entries))
        if dataset.has_means(entry):
            means = dataset.read_means(entry)
            traces += [_means_trace(p, _means_errors(p, body, means)) for p in predict.of_means(entry, means)]
            continue
        trial = dataset.read(entry)
        T_measured = poses_of(body, trial).T
        traces += [_trace(p, trial, pose_errors(p.T_lab_hand, T_measured)) for p in predict(entry, trial)]
    return traces


def regimes(predict: Predictor, dataset: Dataset, role: Role = "validation") -> tuple[Explained, ...]:
    """What the joint models explain, on repetitions of calibration motions and on the trials of a role."""
    joints = predict.joints
    if joints is None or predict.robot is None:
        return ()
    terms = joints.models[0].terms
    again = on_repetitions(joints, (trial for _, trial in dataset.trials("calibration")), terms)
    return (*again, *on_validation(joints, (trial for _, trial in dataset.trials(role)), predict.robot))


def scored_errors(t: np.ndarray, errors: PoseErrors, trial: Trial, static: bool) -> PoseErrors:
    """The errors at t (n,) [s, mocap clock] that count."""
    if static:
        return dwell_means(t, errors, dwell_windows(trial))
    after = t > trial.t_mocap[0] + REFERENCE
    return PoseErrors(errors.position[after], errors.rotation[after])


def ladder(traces: list[Trace], against: str) -> Iterator[Row]:
    """Rows of dynamic, static and all trials, in the traces' order of models."""
    keys = dict.fromkeys((t.model, t.base, t.encoder) for t in traces)
    groups: tuple[tuple[Trials, Callable[[Trace], bool]], ...] = (
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


def row_entry(row: Row) -> dict[str, Any]:
    """A row as evaluation.json and score.json have it."""
    figures = asdict(row.metrics) | turned(row.metrics)
    figures["per_axis_mm"] = dict(zip("xyz", row.metrics.per_axis_mm, strict=True))
    names = {"model": row.model, "trials": row.trials, "base": row.base, "encoder": row.encoder}
    return names | {"against": row.against} | figures


def trial_entry(trace: Trace) -> dict[str, Any]:
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


def _trace(p: Prediction, trial: Trial, errors: PoseErrors) -> Trace:
    scored = scored_errors(p.t, errors, trial, p.kind == "static")
    return Trace(p.model, p.base, p.encoder, p.trial_id, p.kind, p.t, errors, scored)


def _means_errors(p: Prediction, body: Body, means: PostureMeans) -> PoseErrors:
    """Errors of the pose, or of the place of the point that is seen of the hand: its rotations are NaN."""
    if not is_point(body):
        return pose_errors(p.T_lab_hand, means.poses_of(body).T)
    e = places(p.T_lab_hand, point_of(body)) - means.point_of(body)[0]
    return PoseErrors(e, np.full(e.shape, np.nan))


def _means_trace(p: Prediction, errors: PoseErrors) -> Trace:
    return Trace(p.model, p.base, p.encoder, p.trial_id, p.kind, p.t, errors, errors)


def _write_traces(path: Path, traces: tuple[Trace, ...]) -> None:
    """One group a row and trial: model/base/encoder/trial."""
    part = path.with_name(path.name + ".part")
    with netcdf.created(part) as file:
        file.title = "errors of predicted hand poses, predicted minus measured, lab axes"
        for trace in traces:
            group = file.createGroup(f"{trace.model}/{trace.base}/{trace.encoder}/{trace.trial_id}")
            group.kind = trace.kind
            netcdf.add_dimensions(group, {"t": len(trace.t), "scored": len(trace.scored), "axis": 3})
            for name, dims, units, data in (
                ("t", ("t",), "s", trace.t),
                ("position_error", ("t", "axis"), "m", trace.errors.position),
                ("rotation_error", ("t", "axis"), "rad", trace.errors.rotation),
                ("scored_position_error", ("scored", "axis"), "m", trace.scored.position),
                ("scored_rotation_error", ("scored", "axis"), "rad", trace.scored.rotation),
            ):
                netcdf.write_variable(group, name, data, dims, "f8" if name == "t" else "f4", {"units": units})
    os.replace(part, path)
