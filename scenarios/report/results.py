"""What a run folder holds, read for its report: every file but evaluation.json may be missing."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

import calibration
from calibration.schema import Description
from scenarios.errors import ScenarioError
from scenarios.report.recordings import Recorded, recorded
from scenarios.report.traces import Trace, read_traces

M = TypeVar("M", bound=BaseModel)


class Entry(BaseModel):
    """Frozen; what other versions add is left out."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class AxisErrors(Entry):
    """RMSE along the lab's axes [mm]."""

    x: float
    y: float
    z: float


class Row(Entry):
    """A row of evaluation.json or score.json; see the contract for its figures."""

    model: str
    trials: str
    base: str
    encoder: str
    against: str
    n: int
    position_rmse_component_mm: float
    position_rmse_norm_mm: float
    position_p95_norm_mm: float
    position_max_norm_mm: float
    orientation_rmse_deg: float
    orientation_max_deg: float
    per_axis_mm: AxisErrors
    skill: float | None = None

    @property
    def key(self) -> tuple[str, str, str, str]:
        """What the row is about: model, base, encoder, trials."""
        return self.model, self.base, self.encoder, self.trials


class Scored(Entry):
    """A parameter or combination beside its truth, in the unit given."""

    name: str
    unit: str = ""
    truth: float | None = None
    estimate: float | None = None
    sigma: float | None = None
    z: float | None = None
    status: str


class Protocol(Entry):
    """A model under a protocol; see `calibration.protocols`."""

    protocol: str
    model: str
    base: str
    encoder: str
    constants_removed: bool
    n: int
    position_rmse_component_mm: float
    orientation_rmse_component_deg: float


class Compared(Entry):
    """A row against another; see `calibration.comparison`."""

    a: tuple[str, str]
    b: tuple[str, str]
    difference_mm: float
    low_mm: float
    high_mm: float
    finding: str


class Evaluation(Entry):
    """The whole of evaluation.json."""

    rows: tuple[Row, ...]
    protocols: tuple[Protocol, ...] = ()
    comparisons: tuple[Compared, ...] = ()


class Score(Entry):
    """The whole of score.json."""

    rows: tuple[Row, ...]
    parameters: tuple[Scored, ...] = ()
    combinations: tuple[Scored, ...] = ()
    nees: float | None = None
    dof: int | None = None


class ScenarioNote(Entry):
    """What a report says of scenario.yaml."""

    name: str = ""
    description: str = ""
    seed: int | None = None
    versions: dict[str, str] = {}


@dataclass(frozen=True)
class Results:
    """All that a report is made of.

    Attributes:
        evaluation: Errors against the motion capture.
        traces: Errors of each row in each trial, in the order of the file.
        score: Errors against the truth, where it is known.
        estimate: What the calibration found.
        scenario: Name, seed and versions.
        description: The whole of dataset.json.
        recorded: The trials, in the order of dataset.json.
        sha256: Of dataset.json.
        picture: PNG of the robot.
    """

    evaluation: Evaluation
    traces: tuple[Trace, ...]
    score: Score | None
    estimate: calibration.Estimate | None
    scenario: ScenarioNote
    description: Description | None
    recorded: tuple[Recorded, ...]
    sha256: str | None
    picture: bytes | None


def read(run: Path) -> Results:
    """Read a run folder.

    Raises:
        ScenarioError: There is no evaluation, or a file cannot be read.
        InputError: The dataset or the estimate cannot be read.
    """
    evaluation = run / "evaluation.json"
    if not evaluation.is_file():
        raise ScenarioError(f"{run}: holds no evaluation.json; make it with tiago-twin evaluate, see its --help")
    estimate, dataset, picture = run / "estimate", run / "dataset", run / "figures" / "twin.png"
    description = calibration.load(dataset).description if (dataset / "dataset.json").is_file() else None
    return Results(
        evaluation=_json(evaluation, Evaluation),
        traces=read_traces(run / "evaluation.nc"),
        score=_json(run / "score.json", Score) if (run / "score.json").is_file() else None,
        estimate=calibration.load_estimate(estimate) if (estimate / "estimate.json").is_file() else None,
        scenario=_scenario(run / "scenario.yaml"),
        description=description,
        recorded=tuple(recorded(dataset / t.file, t) for t in description.trials) if description else (),
        sha256=hashlib.sha256((dataset / "dataset.json").read_bytes()).hexdigest() if description else None,
        picture=picture.read_bytes() if picture.is_file() else None,
    )


def _json(path: Path, model: type[M]) -> M:
    try:
        return model.model_validate(json.loads(path.read_text(encoding="utf-8")))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path}: broken JSON: {error}; make it again with tiago-twin evaluate") from error
    except ValidationError as error:
        raise ScenarioError(_findings(path, error)) from error


def _scenario(path: Path) -> ScenarioNote:
    if not path.is_file():
        return ScenarioNote()
    try:
        return ScenarioNote.model_validate(YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8")))
    except (YAMLError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path}: broken YAML: {error}") from error
    except ValidationError as error:
        raise ScenarioError(_findings(path, error)) from error


def _findings(path: Path, error: ValidationError) -> str:
    return "\n".join(f"{path}: {'.'.join(map(str, e['loc'])) or 'file'}: {e['msg']}" for e in error.errors())
