"""Judge an estimate by the truth: parameters with their intervals, and every row of the ladder against true hand poses.

    z = (estimate - truth) / sigma       for what the data fix alone, and for the identifiable combinations
    NEES = e' C^-1 e                      over those together; its expectation is their number where the model is true

The truth is read here and nowhere else. The row `floor` is the error left with the true parameters and joint angles,
through the same measurements: T_lab_B measured, all that follows it true.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Literal

import numpy as np

from calibration import Estimate, Evaluation
from calibration.evaluation import Row, TrialErrors, ladder, pose_errors, row_entry, scored_errors
from calibration.inference.parameters import Model
from calibration.inference.parameters import Parameter as EstimatedParameter
from calibration.prediction import BASELINE, PredictedTrial, Prediction
from scenarios.files.errors import ScenarioError
from scenarios.score.base_motion import BaseScore, base_scores
from twin import truth
from twin.truth import Parameter, TruthTrial

Status = Literal["estimated", "combined", "not_identifiable", "not_estimated"]
SPAN_95 = 1.959963984540054
"""Half width of a 95 % interval in standard deviations."""
FLOOR = "floor"
_ALIKE = 1e-9  # [-] share of the largest eigenvalue below which combinations repeat each other


@dataclass(frozen=True)
class Judged:
    """A parameter or an identifiable combination beside its truth; NaN where there is none."""

    name: str
    unit: str
    truth: float
    estimate: float
    sigma: float
    z: float
    status: Status


@dataclass(frozen=True)
class ParameterScore:
    """A model's parameters judged.

    Attributes:
        parameters: Every parameter of the truth.
        combinations: Identifiable combinations of more than one parameter, by their leading one.
        coverage_95: Share of the estimated and the combinations whose 95 % interval holds the truth [-].
        n_covered: How many of them it is.
        n_judged: Of how many.
        nees: Normalised estimation error squared of all of them together [-].
        dof: Its degrees of freedom.
    """

    parameters: tuple[Judged, ...]
    combinations: tuple[Judged, ...]
    coverage_95: float
    n_covered: int
    n_judged: int
    nees: float
    dof: int

    def save(self, folder: Path) -> None:
        """Write score.json."""
        text = json.dumps(self._content(), indent=1, allow_nan=False)
        (folder / "score.json").write_text(text + "\n", encoding="utf-8")

    def _content(self) -> dict[str, object]:
        return {
            "schema": 1,
            "parameters": [_entry(p) for p in self.parameters],
            "combinations": [_entry(p) for p in self.combinations],
            "coverage_95": _finite(self.coverage_95),
            "n_covered": self.n_covered,
            "n_judged": self.n_judged,
            "nees": _finite(self.nees),
            "dof": self.dof,
        }


@dataclass(frozen=True)
class Score(ParameterScore):
    """An estimate judged.

    Attributes:
        rows: The ladder against the truth, floor included.
        skill: Of each row: (registration - row) / (registration - floor) in position RMSE per component [-].
        base: The base's roll and pitch by source of the wrench.
    """

    rows: tuple[Row, ...]
    skill: tuple[float | None, ...]
    base: tuple[BaseScore, ...] = ()

    def _content(self) -> dict[str, object]:
        rows = [row_entry(r) | {"skill": s} for r, s in zip(self.rows, self.skill, strict=True)]
        return super()._content() | {"rows": rows, "base": [asdict(b) for b in self.base]}


def score(estimate: Estimate, evaluation: Evaluation, truth_folder: Path) -> Score:
    """Judge an estimate and the predictions that were evaluated by the truth.

    Raises:
        ScenarioError: The truth is missing or of other trials.
        NotCalibrated: The estimate must not be used.
    """
    judged = judge_parameters(estimate.model(estimate.main), _read_parameters(truth_folder / "truth.json"))
    pairs = [(p, _read_trial(truth_folder / "trials" / f"{p.trial_id}.nc")) for p in evaluation.predicted]
    rows = tuple(ladder(list(_errors(pairs, _true_base_body(truth_folder))), "truth"))
    parts: dict[str, Any] = {f.name: getattr(judged, f.name) for f in fields(judged)}
    base = base_scores(pairs)
    return Score(**parts, rows=rows, skill=tuple(_skill(row, rows) for row in rows), base=base)


def judge_parameters(model: Model, true: Iterable[Parameter]) -> ParameterScore:
    """Judge a model's parameters by the true ones."""
    true = tuple(true)
    parameters = tuple(_parameter(name, unit, value, model) for name, unit, value in true)
    matrix, errors, combinations = _identified(model, {name: value for name, _, value in true})
    covered = np.abs(errors / np.sqrt(np.diag(matrix))) <= SPAN_95
    nees, dof = _nees(errors, matrix) if len(errors) else (np.nan, 0)
    share = float(covered.mean()) if len(covered) else np.nan
    return ParameterScore(parameters, combinations, share, int(covered.sum()), len(covered), nees, dof)


def _entry(judged: Judged) -> dict[str, object]:
    return {k: _finite(v) for k, v in asdict(judged).items()}


def _finite(value: object) -> object:
    """JSON has no NaN: what is not known is null."""
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _read_parameters(path: Path) -> tuple[Parameter, ...]:
    try:
        return truth.read_parameters(path)
    except FileNotFoundError as error:
        raise ScenarioError(f"{path}: no such file; --truth names a run's truth folder") from error
    except (json.JSONDecodeError, KeyError, TypeError) as error:
        raise ScenarioError(f"{path}: not a truth.json ({error}); make the run again") from error


def _parameter(name: str, unit: str, value: float, model: Model) -> Judged:
    found = next((p for p in model.parameters if p.name == name), None)
    if found is None:
        return Judged(name, unit, value, np.nan, np.nan, np.nan, "not_estimated")
    z = (found.value - value) / found.sigma if _has_interval(found) else np.nan
    return Judged(name, unit, value, found.value, found.sigma, z, found.status)


def _has_interval(p: EstimatedParameter) -> bool:
    """Whether an estimate came with a standard deviation; other programs' need not."""
    return p.status == "estimated" and p.sigma > 0.0


def _identified(model: Model, values: dict[str, float]) -> tuple[np.ndarray, np.ndarray, tuple[Judged, ...]]:
    """Covariance (m, m) and errors (m,) of all that is identified and has a truth, and the combinations among it."""
    names = [p.name for p in model.parameters]
    theta = np.array([p.value for p in model.parameters])
    true = np.array([values.get(n, np.nan) for n in names])
    alone = [i for i, p in enumerate(model.parameters) if _has_interval(p) and np.isfinite(true[i])]
    rows = [np.eye(len(names))[i] for i in alone]
    judged = []
    fixed_alone = {names[i] for i in alone}
    for c in model.combinations:
        if c.name in values and c.name not in fixed_alone and np.isfinite(true[c.coefficients != 0.0]).all():
            value = float(c.coefficients @ np.nan_to_num(true))
            unit = model.parameters[names.index(c.name)].unit
            judged.append(Judged(c.name, unit, value, c.value, c.sigma, (c.value - value) / c.sigma, "combined"))
            rows.append(c.coefficients)
    A = np.array(rows).reshape(len(rows), len(names))
    return A @ model.covariance @ A.T, A @ (theta - np.nan_to_num(true)), tuple(judged)


def _nees(errors: np.ndarray, covariance: np.ndarray) -> tuple[float, int]:
    """Sum e' C^+ e and the rank of C, in units of each entry's sigma."""
    sigma = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / sigma / sigma[:, None])
    kept = values > _ALIKE * values[-1]
    projected = vectors[:, kept].T @ (errors / sigma)
    return float((projected**2 / values[kept]).sum()), int(kept.sum())


def _errors(pairs: Iterable[tuple[PredictedTrial, TruthTrial]], T_base_body: np.ndarray) -> Iterator[TrialErrors]:
    """Errors of every prediction, and of the floor, against the true hand pose."""
    floors = []
    for trial, true in pairs:
        for p in (*trial.rows, _floor(trial, true, T_base_body)):
            errors = pose_errors(p.T_lab_hand, true.hand_pose)
            scored = scored_errors(p.t, errors, trial.dwells, p.kind == "static")
            found = TrialErrors(p.model, p.base, p.encoder, p.trial_id, p.kind, p.t, errors, scored)
            if p.model == FLOOR:
                floors.append(found)
            else:
                yield found
    yield from floors


def _read_trial(path: Path) -> TruthTrial:
    if not path.is_file():
        raise ScenarioError(f"{path}: no such file; --truth must be of the same run as the dataset")
    return truth.read_trial(path)


def _true_base_body(truth_folder: Path) -> np.ndarray:
    return np.array(json.loads((truth_folder / "truth.json").read_text(encoding="utf-8"))["derived"]["T_base_base"])


def _floor(trial: PredictedTrial, true: TruthTrial, T_base_body: np.ndarray) -> Prediction:
    """T_lab_B measured, T_B_hand true (n, 4, 4)."""
    T_B_hand = np.linalg.solve(true.base_pose @ T_base_body, true.hand_pose)
    return Prediction(FLOOR, "measured", "link", trial.trial_id, trial.kind, trial.t, trial.T_lab_B @ T_B_hand)


def _skill(row: Row, rows: tuple[Row, ...]) -> float | None:
    """1 at the floor, 0 at the registration-only baseline with the same source of base motion."""
    like = {r.model: r.metrics.position_rmse_component_mm for r in rows if (r.trials, r.base) == (row.trials, row.base)}
    floor = next(
        (r.metrics.position_rmse_component_mm for r in rows if (r.model, r.trials) == (FLOOR, row.trials)), None
    )
    start = like.get(BASELINE)
    if floor is None or start is None or start == floor:
        return None
    return (start - row.metrics.position_rmse_component_mm) / (start - floor)
