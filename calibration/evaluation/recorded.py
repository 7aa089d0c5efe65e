"""Recordings an estimate is scored on: read once, judged as calibration recordings are, compared with the estimate.

What cannot be true, or was calibrated on, is refused. What does not follow the calibrated robot as the calibration's
own motions did is named, as a warning: it may be the estimate that is wrong.
"""

from collections.abc import Iterator, Sequence

from calibration.checks.changes import constants
from calibration.checks.recordings import judged, listed_twice
from calibration.checks.unexplained import passed, unexplained
from calibration.errors import InputError, InputErrors
from calibration.estimate.estimate import Estimate
from calibration.mocap.labels import relabelled_trial
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.recording.clock import Clock
from calibration.recording.dataset import Dataset
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Role, TrialEntry
from calibration.robot.laboratory import Laboratory
from calibration.stages.frames.base_rests import MOVES
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.verdict import Verdict

Recorded = tuple[TrialEntry, MeasuredTrial | PostureMeans]


def recorded(dataset: Dataset, entry: TrialEntry) -> Recorded:
    """One trial, as it is scored.

    Raises:
        InputError: As `Dataset.read`.
    """
    return entry, dataset.read_means(entry) if dataset.has_means(entry) else relabelled_trial(dataset, entry)


def believable(dataset: Dataset, role: Role, read: Sequence[Recorded]) -> tuple[Verdict, ...]:
    """Warnings about the recordings of a role.

    Raises:
        InputErrors: They cannot be true, or are recordings of another role as well.
    """
    path = dataset.folder / "dataset.json"
    entries = (*dataset.entries("calibration"), *(entry for entry, _ in read))
    twice = [InputError(path, message) for message in listed_twice(entries) if f"({role})" in message]
    if twice:
        raise InputErrors(twice)
    found = judged(Laboratory(dataset.urdf, dataset.description), [trial for _, trial in read])
    wrong = [InputError(path, f"{role} recordings: {v.message}") for v in found if v.verdict == "refused"]
    if wrong:
        raise InputErrors(wrong)
    return found


def departures(
    estimate: Estimate, dataset: Dataset, robot: Clock | None, read: Sequence[Recorded]
) -> Iterator[Verdict]:
    """What the recordings do not share with those the estimate's geometry is of."""
    model = next((m for m in estimate.models if m.name == "model_2"), None)
    trials = [t for entry, t in read if isinstance(t, MeasuredTrial) and len(t.t_robot) and entry.kind not in MOVES]
    if model is None or robot is None or not trials or dataset.description.hand_body.is_point:
        return
    lab = Laboratory(estimate.urdf or dataset.urdf, dataset.description)
    hand = hand_of(model, lab.chain, lab.nominal_frames)
    for trial in trials:
        samples = passed([trial], robot)
        if len(samples.t):
            yield from constants(unexplained(hand, model, samples), dataset.description, trial.id)
        else:
            message = f"{trial.id}: no reading is beside a marker by the calibrated clock: another clock or session?"
            yield Verdict("reading", "warning", message)
