"""Prediction and error of an estimate in a session recorded later: the command `predict`.

files, mapping -> dataset/     estimate -> estimate/ of that day     predicted.csv; evaluation.json, report.html where
                                                                     base and hand were seen
"""

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.files import output_folder as folder
from scenarios.files.errors import ScenarioError
from scenarios.steps import run_steps
from scenarios.steps.import_export import import_files
from scenarios.steps.run_steps import Progress, silent
from scenarios.steps.threads import one_blas_thread

if TYPE_CHECKING:
    from calibration import Dataset, Estimate

PREDICTED = "predicted.csv"
SESSION = replace(folder.RUN, name="prediction", marker=PREDICTED, entries=folder.RUN.entries | {PREDICTED})
_HEADER = ("trial", "t", "x", "y", "z", "qw", "qx", "qy", "qz", "sigma_position", "sigma_rotation")


@dataclass(frozen=True)
class Predicted:
    """What was made.

    Attributes:
        scored: Whether base and hand were seen, so that there are an evaluation and a report.
        notes: What was recognised in the files.
    """

    scored: bool
    notes: tuple[str, ...]


def predict(  # noqa: PLR0913  an option each
    estimate: Path,
    files: Sequence[Path],
    mapping: Path,
    out: Path,
    register: int = 0,
    progress: Progress = silent,
) -> Predicted:
    """Predict, and where the hand was seen score, a session recorded later into the folder `out`.

    Args:
        estimate: An estimate folder.
        files: Of the session; those the mapping names where there are none.
        mapping: A mapping file; that of the first session does where columns and labels are the same.
        out: The folder to write.
        register: How many static postures, the first ones, register the marker bodies; 0: they are where they were.
        progress: Called with how far it is.

    Raises:
        ScenarioError: `out` must not be overwritten, or the mapping is malformed.
        InputError: A file is not what the mapping says, or the estimate is another robot's.
        CalibrationError: The estimate must not be used, or its postures register nothing.
    """
    from calibration import load, load_estimate, save_estimate
    from calibration.prediction import on_another_day

    known = load_estimate(estimate)
    known.require_calibrated()
    if known.laboratory is None:
        raise ScenarioError(f"{estimate}: does not contain its laboratory; calibrate again")
    with folder.replacing(out, SESSION) as new, one_blas_thread():
        dataset = new / "dataset"
        notes = import_files(None, files, mapping, dataset, later=known.laboratory, progress=progress)
        today = on_another_day(known, dataset, register)
        notes += tuple(v.message for v in today.verdicts[len(known.verdicts) :])
        save_estimate(today, new / "estimate")
        _write(new / PREDICTED, today, load(dataset))
        scored = _sees_hand(load(dataset))
        if scored:
            run_steps.evaluate(new / "estimate", dataset, new, progress=progress)
            run_steps.report(new, progress)
    return Predicted(scored, notes)


def _write(path: Path, estimate: "Estimate", dataset: "Dataset") -> None:
    """T_base_hand of every reading [m, quaternion], robot clock [s]; of posture means their number."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(_HEADER)
        for row in _rows(estimate, dataset):
            table.writerow(row)


def _rows(estimate: "Estimate", dataset: "Dataset") -> Iterator[list[str]]:
    import numpy as np
    from scipy.spatial.transform import Rotation

    from calibration import Compensator

    for entry in dataset.entries("validation"):
        if dataset.has_means(entry):
            q = dataset.read_means(entry).q_motor
            t = np.arange(float(len(q)))
        else:
            trial = dataset.read(entry)
            t, q = trial.t_robot, trial.q_motor
        if not len(q):
            continue
        found = Compensator.of(estimate, entry.payload).predict(t, q)
        wxyz = Rotation.from_matrix(found.T[:, :3, :3]).as_quat(canonical=True, scalar_first=True)
        variance = np.diagonal(found.covariance, axis1=1, axis2=2).reshape(-1, 2, 3).mean(axis=2)
        table = np.concatenate([t[:, None], found.T[:, :3, 3], wxyz, np.sqrt(variance)], axis=1)
        yield from ([entry.id, *(f"{x:.9g}" for x in row)] for row in table)


def _sees_hand(dataset: "Dataset") -> bool:
    """Whether every trial that is predicted shows base and hand, on a known clock."""
    bodies = (dataset.description.base_body, dataset.description.hand_body)
    wanted = {m.name for body in bodies for m in body.markers}
    found = []
    for entry in dataset.entries("validation"):
        seen = dataset.read_means(entry).marker if dataset.has_means(entry) else dataset.read(entry).marker
        found.append(wanted <= set(seen))
    return bool(found) and all(found)
