"""Content of a run folder, read for its report: every file but evaluation.json or an estimate may be missing."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

import calibration
from calibration.prediction import PredictedTrial, read_predicted
from calibration.recording import Description
from calibration.untrusted import read_json, read_text, yaml_of
from scenarios.files.errors import ScenarioError
from scenarios.report.results.recordings import Recorded, recorded
from scenarios.report.results.result_files import Derived, Evaluation, ScenarioNote, Score, Truth
from scenarios.report.results.traces import Trace, read_traces

M = TypeVar("M", bound=BaseModel)


@dataclass(frozen=True)
class Results:
    """All that a report is made of.

    Attributes:
        evaluation: Errors against the motion capture.
        traces: Errors of each row in each trial, in the order of the file.
        score: Errors against the truth, where it is known.
        estimate: What the calibration found.
        stiffness: The true K of the base on its wheels, where it is known; NaN where rigid.
        damping: The true C.
        scenario: Name, seed and versions.
        dataset: The recordings.
        recorded: The trials, in the order of dataset.json.
        sha256: Of dataset.json.
        picture: PNG of the robot.
        predicted: Base and joints of the held-out trials as they were predicted, by trial.
    """

    evaluation: Evaluation
    traces: tuple[Trace, ...]
    score: Score | None
    estimate: calibration.Estimate | None
    stiffness: np.ndarray | None
    damping: np.ndarray | None
    scenario: ScenarioNote
    dataset: calibration.Dataset | None
    recorded: tuple[Recorded, ...]
    sha256: str | None
    picture: bytes | None
    predicted: dict[str, PredictedTrial]

    @property
    def description(self) -> Description | None:
        """The whole of dataset.json."""
        return self.dataset.description if self.dataset else None


def read(run: Path) -> Results:
    """Read a run folder.

    Raises:
        ScenarioError: There is neither evaluation nor estimate, or a file cannot be read.
        InputError: The dataset or the estimate cannot be read.
    """
    evaluation, dataset, picture = run / "evaluation.json", run / "dataset", run / "figures" / "twin.png"
    estimate = run if (run / "estimate.json").is_file() else run / "estimate"
    evaluated = evaluation.is_file()
    if not evaluated and not (estimate / "estimate.json").is_file():
        raise ScenarioError(f"{run}: contains no evaluation.json; make it with tiago-twin evaluate, see its --help")
    loaded = calibration.load(dataset) if (dataset / "dataset.json").is_file() else None
    trials = loaded.description.trials if loaded else ()
    truth = run / "truth" / "truth.json"
    derived = _json(truth, Truth).derived if truth.is_file() else Derived()
    return Results(
        evaluation=_json(evaluation, Evaluation) if evaluated else Evaluation(rows=()),
        traces=read_traces(run / "evaluation.nc") if evaluated else (),
        score=_json(run / "score.json", Score) if (run / "score.json").is_file() else None,
        estimate=calibration.load_estimate(estimate) if (estimate / "estimate.json").is_file() else None,
        scenario=read_scenario(run / "scenario.yaml"),
        stiffness=_matrix(derived.K),
        damping=_matrix(derived.C),
        dataset=loaded,
        recorded=tuple(recorded(dataset / t.file, t) for t in trials),
        sha256=hashlib.sha256((dataset / "dataset.json").read_bytes()).hexdigest() if loaded else None,
        picture=picture.read_bytes() if picture.is_file() else None,
        predicted={path.stem: read_predicted(path) for path in sorted((run / "predictions").glob("*.nc"))},
    )


def _matrix(rows: tuple[tuple[float | None, ...], ...] | None) -> np.ndarray | None:
    return None if rows is None else np.array(rows, dtype=float)


def _json(path: Path, model: type[M]) -> M:
    try:
        return model.model_validate(read_json(path))
    except ValidationError as error:
        raise ScenarioError(_findings(path, error)) from error


def read_scenario(path: Path) -> ScenarioNote:
    """Name, seed and versions of a run; empty where there is no file.

    Raises:
        ScenarioError: The file cannot be read.
    """
    if not path.is_file():
        return ScenarioNote()
    try:
        return ScenarioNote.model_validate(yaml_of(read_text(path), path))
    except ValidationError as error:
        raise ScenarioError(_findings(path, error)) from error


def _findings(path: Path, error: ValidationError) -> str:
    return "\n".join(f"{path}: {'.'.join(map(str, e['loc'])) or 'file'}: {e['msg']}" for e in error.errors())
