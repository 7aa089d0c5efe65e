"""Parameters of an estimate beside the true ones, with their intervals.

    z = (estimate - truth) / sigma       for what the data fix alone, and for the identifiable combinations
    NEES = e' C^-1 e                      over those together; its expectation is their number where the model is true

Every model is judged by its own intervals. A parameter of several models is listed once: of the main model where it
has it, else of the first one that does.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from calibration import Estimate
from calibration.inference import Model
from calibration.inference import Parameter as EstimatedParameter
from twin.truth import Parameter

Status = Literal["estimated", "combined", "not_identifiable", "not_estimated"]
SPAN_95 = 1.959963984540054
"""Half width of a 95 % interval in standard deviations."""
_ALIKE = 1e-9  # [-] share of the largest eigenvalue below which combinations repeat each other


@dataclass(frozen=True)
class Judged:
    """A parameter or an identifiable combination of a model beside its truth; NaN, "" where there is none."""

    name: str
    unit: str
    truth: float
    estimate: float
    sigma: float
    z: float
    status: Status
    model: str = ""


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
        text = json.dumps(self.content(), indent=1, allow_nan=False)
        (folder / "score.json").write_text(text + "\n", encoding="utf-8")

    def content(self) -> dict[str, object]:
        """As in score.json."""
        return {
            "schema": 1,
            "parameters": [_entry(p) for p in self.parameters],
            "combinations": [_entry(p) for p in self.combinations],
        } | self.coverage()

    def coverage(self) -> dict[str, object]:
        """How many intervals hold the truth, and how far the errors are together."""
        figures = ("coverage_95", "n_covered", "n_judged", "nees", "dof")
        return {name: _finite(getattr(self, name)) for name in figures}


ModelScore = tuple[str, ParameterScore]
"""A model's name, and its parameters judged."""


def with_holding(parameters: Iterable[Parameter]) -> Iterator[Parameter]:
    """Coulomb friction of a link with what holds it in its backlash: a joint's readings show their sum alone."""
    parameters = tuple(parameters)
    holding = {p.name.split(".")[1]: p.value for p in parameters if p.name.endswith(".holding")}
    for p in parameters:
        kind, _, rest = p.name.partition(".")
        joint, _, what = rest.rpartition(".")
        more = holding.get(joint, 0.0) if (kind, what) == ("friction", "coulomb") else 0.0
        yield p._replace(value=p.value + more)


def judge_estimate(estimate: Estimate, true: Iterable[Parameter]) -> tuple[tuple[Judged, ...], tuple[ModelScore, ...]]:
    """Every true parameter once, and every model, the main one first."""
    true = tuple(true)
    models = sorted(estimate.models, key=lambda m: m.name != estimate.main)
    judged = tuple((m.name, judge_parameters(m, true)) for m in models)
    columns = zip(*(score.parameters for _, score in judged), strict=True)
    return tuple(next((j for j in column if j.model), column[0]) for column in columns), judged


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


def _parameter(name: str, unit: str, value: float, model: Model) -> Judged:
    found = next((p for p in model.parameters if p.name == name), None)
    if found is None:
        return Judged(name, unit, value, np.nan, np.nan, np.nan, "not_estimated")
    z = (found.value - value) / found.sigma if _has_interval(found) else np.nan
    return Judged(name, unit, value, found.value, found.sigma, z, found.status, model.name)


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
            z = (c.value - value) / c.sigma
            judged.append(Judged(c.name, unit, value, c.value, c.sigma, z, "combined", model.name))
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
