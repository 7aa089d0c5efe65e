"""Score every model's held-out predictions against the motion capture.

Dynamic trials sample by sample, static ones by the mean error over each dwell; `all` is both together. A trial's first
second is the base's reference and is not scored. The reference is the hand cluster's measured pose: its own noise
counts.

What is to be said of an evaluation: trials whose errors are not the model's, rows worse than those they build on.

A base that was pushed, rolled or lifted while a trial was recorded: no prediction is told, and those that do not
measure the base keep the place it had in the first second.
"""

import json
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from calibration.errors import NotEnoughData
from calibration.estimate.estimate import Estimate
from calibration.evaluation.comparison import Comparison, comparisons
from calibration.evaluation.joint_regimes import RegimeQuality, on_repetitions, on_validation
from calibration.evaluation.ladder import Row, TrialErrors, Trials, ladder, row_entry, scored_errors, trial_entry
from calibration.evaluation.marker_errors import PointRow, point_rows
from calibration.evaluation.pose_errors import PoseErrors, pose_errors
from calibration.evaluation.protocols import protocol_rows
from calibration.mocap.cluster_pose import point_of_means, poses_of, poses_of_means
from calibration.mocap.labels import relabelled_trial, relabelled_trials
from calibration.numerics.lie import inverse, mean, places, to_vector
from calibration.prediction.predictor import Prediction, Predictor, predictor
from calibration.prediction.second_session import registration_trials, reregistered
from calibration.recording import netcdf
from calibration.recording.dataset import Dataset
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Body, Description, Role, TrialEntry
from calibration.recording.trial import REST, Trial
from calibration.stages.frames.base_rests import MOVES
from calibration.stages.suspension.checks import moved_by
from calibration.verdict import Verdict

STAGE = "evaluation"


def _traces(
    predict: Predictor,
    dataset: Dataset,
    entries: tuple[TrialEntry, ...],
    progress: Callable[[str, float], None] | None,
) -> list[TrialErrors]:
    """Errors of every row in each of these trials."""
    body, traces = dataset.description.hand_body, []
    for k, entry in enumerate(entries):
        if progress is not None:
            progress(f"evaluating {entry.id}", k / len(entries))
        if dataset.has_means(entry):
            means = dataset.read_means(entry)
            traces += [_means_trace(p, _means_errors(p, body, means)) for p in predict.of_means(entry, means)]
            continue
        trial = relabelled_trial(dataset, entry)
        T_measured = poses_of(body, trial).T
        traces += [_trace(p, trial, pose_errors(p.T_lab_hand, T_measured)) for p in predict(entry, trial)]
    return traces


def regimes(predict: Predictor, dataset: Dataset, role: Role = "validation") -> tuple[RegimeQuality, ...]:
    """What the joint models explain, on repetitions of calibration motions and on the trials of a role."""
    joints = predict.joints
    if joints is None or predict.robot is None:
        return ()
    terms = joints.models[0].terms
    again = on_repetitions(joints, (trial for _, trial in relabelled_trials(dataset, "calibration")), terms)
    return (*again, *on_validation(joints, (trial for _, trial in relabelled_trials(dataset, role)), predict.robot))


@dataclass(frozen=True)
class Evaluation:
    """The ladder, the errors it is made of, and what the joint models explain of each joint's discrepancy.

    `confirmation` is the ladder of another session, its marker bodies registered anew; empty where there is none.
    `verdicts` name trials whose errors are not the model's.
    `points` are single markers of trials that hold posture means.
    """

    rows: tuple[Row, ...]
    traces: tuple[TrialErrors, ...]
    regimes: tuple[RegimeQuality, ...] = ()
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
    confirmed: list[TrialErrors] = []
    if registering:
        later = tuple(e for e in dataset.entries("confirmation") if e not in registering)
        confirmed = _traces(reregistered(predict, dataset), dataset, later, progress)
    if progress is not None:
        progress("joint models", 1.0)
    rows, confirmation = tuple(ladder(traces, "mocap")), tuple(ladder(confirmed, "mocap"))
    moved = tuple(moved_in_trials(dataset.description, relabelled_trials(dataset, role)))
    points = point_rows(estimate, dataset, role)
    return Evaluation(rows, tuple(traces), regimes(predict, dataset, role), confirmation, moved, points)


def _trace(p: Prediction, trial: Trial, errors: PoseErrors) -> TrialErrors:
    scored = scored_errors(p.t, errors, trial, p.kind == "static")
    return TrialErrors(p.model, p.base, p.encoder, p.trial_id, p.kind, p.t, errors, scored)


def _means_errors(p: Prediction, body: Body, means: PostureMeans) -> PoseErrors:
    """Errors of the pose, or of the place of the point that is seen of the hand: its rotations are NaN."""
    if not body.is_point:
        return pose_errors(p.T_lab_hand, poses_of_means(body, means).T)
    e = places(p.T_lab_hand, body.point) - point_of_means(body, means)[0]
    return PoseErrors(e, np.full(e.shape, np.nan))


def _means_trace(p: Prediction, errors: PoseErrors) -> TrialErrors:
    return TrialErrors(p.model, p.base, p.encoder, p.trial_id, p.kind, p.t, errors, errors)


def _write_traces(path: Path, traces: tuple[TrialErrors, ...]) -> None:
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


def moved_in_trials(description: Description, pairs: Iterable[tuple[TrialEntry, Trial]]) -> Iterator[Verdict]:
    """A warning that names the trials after which the base stands elsewhere; none where it is meant to move."""
    found = {entry.id: _moved(description, trial) for entry, trial in pairs if entry.kind not in MOVES}
    told = ", ".join(f"{name} by {how}" for name, how in found.items() if how)
    if told:
        message = f"base moved during {told}: their errors with the base not measured are not the model's"
        yield Verdict(STAGE, "warning", message)


def no_better(compared: Iterable[Comparison]) -> Iterator[Verdict]:
    """A warning for each row that is worse than the one it builds on, and why where that is known."""
    for c in compared:
        if c.finding == "worse":
            message = f"{c.b[0]} ({c.b[1]}) is worse than {c.a[0]} by {c.difference_mm:.2f} mm"
            yield Verdict(STAGE, "warning", message + (f": {c.reason}" if c.reason else ""))


def _moved(description: Description, trial: Trial) -> str:
    T, t = poses_of(description.base_body, trial).T, trial.t_mocap
    seen = np.isfinite(T).all(axis=(1, 2))
    before, after = seen & (t <= t[0] + REST), seen & (t >= t[-1] - REST)
    if not before.any() or not after.any():
        return ""
    return moved_by(to_vector(inverse(mean(T[before])) @ mean(T[after])))
