"""Score every model's held-out predictions against the motion capture.

Dynamic trials sample by sample, static ones by the mean error over each dwell; `all` is both together. A trial's first
second is the base's reference and is not scored. The reference is the hand cluster's measured pose: its own noise
counts. Each trial is read once and predicted once; nothing is fitted.

A base that was pushed, rolled or lifted while a trial was recorded is reported: no row predicts it, and rows that do
not measure the base keep the place it had in the first second.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.checks.plates import moved_by
from calibration.errors import NotEnoughData
from calibration.estimate.drawings import redrawn
from calibration.estimate.estimate import Estimate
from calibration.estimate.rows import NOMINAL, SOURCES
from calibration.evaluation.bands import Bands, place_noise
from calibration.evaluation.budget import Causes, budget, causes
from calibration.evaluation.joint_regimes import TrialResiduals, residuals, validation_qualities
from calibration.evaluation.ladder import Row, TrialErrors, ladder, trial_errors
from calibration.evaluation.marker_errors import point_rows
from calibration.evaluation.pose_errors import PoseErrors, pose_errors
from calibration.evaluation.recorded import Recorded, believable, departures, recorded
from calibration.evaluation.results import STAGE, Evaluation
from calibration.evaluation.submission import Submission
from calibration.mocap.cluster_pose import point_of_means, poses_of, poses_of_means
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.lie import inverse, mean, places, to_vector
from calibration.numerics.side_by_side import side_by_side
from calibration.prediction.foreign import check_names, registered
from calibration.prediction.predict import predictor
from calibration.prediction.predicted_trial import BaseMotion, PredictedTrial, Prediction
from calibration.prediction.predictor import Predictor, TrialPoses
from calibration.prediction.second_session import registration_trials, reregistered
from calibration.recording.dataset import Dataset
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Body, Role, TrialEntry
from calibration.recording.trial import REST, Trial
from calibration.stages.frames.base_rests import MOVES
from calibration.verdict import Verdict

_SEEN = 1e-4  # [rad] of yaw, below which it does not matter
_UNITS = 1e3  # [mm] of another unit, not of another robot

Progress = Callable[[str, float], None]
NOTHING = Estimate("calibrated", (), (), (), "")
"""An estimate without a model: the nominal robot is all there is."""


@dataclass(frozen=True)
class _Scored:
    """One trial, read and predicted.

    Attributes:
        entry: Of dataset.json.
        predicted: Every row.
        errors: Of every row.
        base_moved: How far the base moved for good; empty where it did not.
        residuals: Of the joint models, None without them.
        means: The recording, where it holds posture means.
        causes: Of the delivered row's error, of a trial that moves.
    """

    entry: TrialEntry
    predicted: PredictedTrial
    errors: tuple[TrialErrors, ...]
    base_moved: str = ""
    residuals: TrialResiduals | None = None
    means: PostureMeans | None = None
    causes: Causes | None = None


def evaluate(
    estimate: Estimate | Submission,
    dataset: Dataset,
    progress: Progress | None = None,
    role: Role = "validation",
) -> Evaluation:
    """Score an estimate, or submitted predictions, on the trials of a role.

    Marker frames of an estimate that does not have them are fitted on the calibration trials.

    Raises:
        InputError: Names, units, frames or clocks of another program are not the contract's; recordings cannot be true.
        NotEnoughData: There is no trial of that role.
        NotCalibrated: The estimate must not be used.
    """
    entries = dataset.entries(role)
    if not entries:
        raise NotEnoughData(f"no trial has role {role}; keep trials aside in the mapping (`trials: {{{role}: [...]}}`)")
    submitted, estimate = (estimate, NOTHING) if isinstance(estimate, Submission) else (None, estimate)
    read = tuple(side_by_side(lambda entry: recorded(dataset, entry), entries))
    remarks = (*check_names(estimate, dataset), *believable(dataset, role, read))
    estimate = estimate if estimate.registered else registered(estimate, dataset)
    estimate, redrawn_bodies = redrawn(estimate, dataset.description)
    remarks += redrawn_bodies
    predict, report = predictor(estimate, dataset), progress or (lambda at, share: None)
    remarks += tuple(departures(estimate, dataset, predict.robot, read)) if role == "validation" else ()
    scored = _each(predict, Bands(estimate, dataset.description, predict.robot), dataset, read, report, submitted)
    if submitted is not None:
        pairs = (zip(one.predicted.rows, one.errors, strict=True) for one in scored)
        own = [(p, e.errors) for of_trial in pairs for p, e in of_trial if p.base == "submitted"]
        remarks += tuple(submitted.remarks(dataset, role, own))
    if not estimate.robot:
        remarks += estimate.verdicts
    registering = registration_trials(dataset) if role == "validation" else ()
    confirmed: list[TrialErrors] = []
    later = tuple(e for e in dataset.entries("confirmation") if e not in registering)
    if registering and later:
        again, others = reregistered(predict, dataset), tuple(recorded(dataset, e) for e in later)
        confirmed = [error for one in _each(again, None, dataset, others, report, submitted) for error in one.errors]
    errors = [error for one in scored for error in one.errors]
    rows = tuple(ladder(errors, "mocap"))
    remarks += () if estimate.robot else tuple(of_another_robot(rows))
    joints = validation_qualities(predict.joints, [one.residuals for one in scored if one.residuals is not None])
    means, predicted = ((o.entry, o.means) for o in scored if o.means is not None), tuple(o.predicted for o in scored)
    return Evaluation(
        rows=rows,
        traces=tuple(errors),
        regimes=(*estimate.regimes, *joints) if predict.joints is not None else (),
        confirmation=tuple(ladder(confirmed, "mocap")),
        verdicts=(*remarks, *moved_in_trials(scored), *not_predictable(predicted), *frictions_shown(predicted)),
        points=point_rows(estimate, dataset.description, means),
        predicted=predicted,
        main=estimate.main if submitted is None else submitted.name,
        budget=budget([one.causes for one in scored if one.causes is not None]),
    )


def _each(
    predict: Predictor,
    promised: Bands | None,
    dataset: Dataset,
    read: tuple[Recorded, ...],
    report: Progress,
    submitted: Submission | None = None,
) -> list[_Scored]:
    def posed(entry: TrialEntry, trial: MeasuredTrial | PostureMeans) -> TrialPoses | None:
        return None if isinstance(trial, PostureMeans) else predict.poses(entry, trial)

    def scored(k: int, entry: TrialEntry, trial: MeasuredTrial | PostureMeans, made: TrialPoses | None) -> _Scored:
        report(f"evaluating {entry.id}", k / len(read))
        if isinstance(trial, PostureMeans):
            return _of_means(predict, dataset, (entry, trial), submitted)
        return _of_trial(predict, promised, dataset, (entry, trial, made), submitted)

    entries, trials = zip(*read, strict=True)
    poses = side_by_side(posed, entries, trials)
    shared = [(one, source) for one in poses if one is not None for source in ("measured", *SOURCES)]
    side_by_side(lambda of: of[0].prepare(of[1]), shared)  # three trials do not divide by two cores
    return side_by_side(scored, range(len(read)), entries, trials, poses)


def _of_trial(
    predict: Predictor,
    promised: Bands | None,
    dataset: Dataset,
    read: tuple[TrialEntry, MeasuredTrial, TrialPoses | None],
    submitted: Submission | None,
) -> _Scored:
    entry, trial, poses = read
    T_measured, predicted = poses_of(dataset.description.hand_body, trial).T, predict(entry, trial, poses)
    predicted = predicted if promised is None else promised.on(predicted, entry, trial)
    own = None if submitted is None else submitted.row(entry, trial.t_mocap, T_measured)
    predicted = predicted if own is None else replace(predicted, rows=(*predicted.rows, own))
    noise = place_noise(dataset.description, trial)
    errors = [trial_errors(p, T_measured, predicted.dwells, noise) for p in predicted.rows]
    moved = "" if entry.kind in MOVES else _moved(predicted)
    left = None
    if predict.joints is not None and predict.robot is not None and predicted.corrected is not None:
        left = residuals(predict.joints, trial, predicted.corrected, predict.robot)
    return _Scored(entry, predicted, tuple(errors), moved, left, causes=_causes(predict, predicted, trial))


def _causes(predict: Predictor, predicted: PredictedTrial, trial: Trial) -> Causes | None:
    """Causes of the delivered row's error after the first second; None of a trial that does not move."""
    parts, t, description = predicted.delivered, predicted.t, predict.description
    if parts is None:
        return None
    hand = poses_of(description.hand_body, trial)
    noise = description.sigmas.marker**2 * hand.covariance[:, :3, :3].trace(axis1=1, axis2=2) / 3.0
    return causes(parts, t, hand.T, predicted.T_lab_B, parts.q_link, noise)


def _of_means(
    predict: Predictor, dataset: Dataset, read: tuple[TrialEntry, PostureMeans], submitted: Submission | None
) -> _Scored:
    entry, means = read
    rows = tuple(predict.of_means(entry, means))
    if submitted is not None:
        hand = dataset.description.hand_body
        unseen = np.full((len(means), 4, 4), np.nan)
        T = unseen if hand.is_point else poses_of_means(hand, means).T
        own = submitted.row(entry, np.arange(float(len(means))), T)
        rows = rows if own is None else (*rows, own)
    errors = (_means_errors(p, dataset.description.hand_body, means) for p in rows)
    found = tuple(
        TrialErrors(p.model, p.base, p.encoder, p.trial_id, p.kind, p.t, e, e)
        for p, e in zip(rows, errors, strict=True)
    )
    return _Scored(entry, PredictedTrial(entry.id, entry.kind, np.arange(float(len(means))), rows), found, means=means)


def _means_errors(p: Prediction, body: Body, means: PostureMeans) -> PoseErrors:
    """Errors of the pose, or of the place of the point that is seen of the hand: its rotations are NaN."""
    if not body.is_point:
        return pose_errors(p.T_lab_hand, poses_of_means(body, means).T)
    e = places(p.T_lab_hand, body.point) - point_of_means(body, means)[0]
    return PoseErrors(e, np.full(e.shape, np.nan))


def of_another_robot(rows: tuple[Row, ...]) -> Iterator[Verdict]:
    """A warning of every model all of whose rows are worse than the nominal robot's worst [mm]."""
    mm: dict[str, list[float]] = {}
    for row in rows:
        if row.trials == "all":
            mm.setdefault(row.model, []).append(row.metrics.position_rmse_norm_mm)
    nominal = max(mm.pop(NOMINAL, [np.inf]))
    for model, found in mm.items():
        if min(found) > nominal:
            question = "is it a calibration of this robot" if min(found) < _UNITS else "are its lengths in m"
            message = f"{model}: {min(found):.2f} mm, the nominal robot {nominal:.2f} mm; {question}?"
            yield Verdict(STAGE, "warning", message)


def frictions_shown(trials: Sequence[PredictedTrial]) -> Iterator[Verdict]:
    """Friction that the wrist's sensor showed in trials under a load that the calibration did not have."""
    of_trials = ((p.trial_id, *of) for p in trials for of in p.frictions)
    found = ", ".join(f"{joint} {f:.2f} N.m in {name} (calibrated {old:.2f})" for name, joint, f, old in of_trials)
    if found:
        message = (
            f"under a load that the calibration did not have the wrist's sensor shows another friction of {found}, "
            "which was used there; calibrate with that load to have it without the sensor"
        )
        yield Verdict(STAGE, "ok", message)


def not_predictable(trials: Sequence[PredictedTrial]) -> Iterator[Verdict]:
    """Warnings: trials in which the base slips as nobody can predict; in which one at rest would be nearer."""
    moved = [(p.trial_id, p.base.slipping) for p in trials if p.base is not None and p.base.slipping is not None]
    found = [(name, 1e3 * float(np.sqrt(m.variance[:, 5].mean()))) for name, m in moved if not m.predictable]
    if found:
        how = ", ".join(f"{name} ({sigma:.1f} mrad)" for name, sigma in found)
        message = (
            f"yaw of the base cannot be predicted in {how}: its standard deviation exceeds its predicted motion; "
            "measure the base, or move more softly"
        )
        yield Verdict(STAGE, "warning", message)
    if worse := ", ".join(p.trial_id for p in trials if p.base is not None and _at_rest_is_nearer(p.base)):
        message = f"a base at rest predicts its yaw better than the plate in {worse}: measure the base there"
        yield Verdict(STAGE, "warning", message)


def _at_rest_is_nearer(base: BaseMotion) -> bool:
    """Whether the markers' yaw is nearer to none than to the predicted one."""
    if base.slipping is None:
        return False
    seen, found = base.measured[:, 5], base.slipping.x[:, 5]
    return bool(np.nanmean((seen - found) ** 2) > np.nanmean(seen**2) + _SEEN**2)


def moved_in_trials(scored: Iterable[_Scored]) -> Iterator[Verdict]:
    """A warning that names the trials after which the base is elsewhere; none where it is meant to move."""
    found = ", ".join(f"{one.entry.id} by {one.base_moved}" for one in scored if one.base_moved)
    if found:
        message = f"base moved during {found}: their errors with the base not measured are not the model's"
        yield Verdict(STAGE, "warning", message)


def _moved(predicted: PredictedTrial) -> str:
    T, t = predicted.T_lab_B, predicted.t
    seen = np.isfinite(T).all(axis=(1, 2))
    before, after = seen & (t <= t[0] + REST), seen & (t >= t[-1] - REST)
    if not before.any() or not after.any():
        return ""
    return moved_by(to_vector(inverse(mean(T[before])) @ mean(T[after])))
