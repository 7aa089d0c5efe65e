"""Monte-Carlo validation: what a method promises against what it does, over many robots.

    coverage: do 95 % intervals hold the truth, parameter by parameter?
    power:    how often does a campaign show that the calibrated model is better, and how does that depend on a value?

Robots are independent, parameters of one robot are not: intervals of a mean over robots come from the spread between
robots (Student), those of a share of robots from the binomial law (Clopper and Pearson, Biometrika 1934).
"""

import json
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from scipy import stats

from scenarios.datasets.index import Row, write_whole
from scenarios.datasets.run_spec import run_name
from scenarios.score.parameters import SPAN_95


@dataclass(frozen=True)
class Interval:
    """A value with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Parameter:
    """What the runs say of one parameter or identifiable combination.

    Attributes:
        name: As in score.json.
        unit: Its own.
        n: Number of runs that estimated it.
        bias: Mean error.
        rmse: Root mean squared error.
        sigma: Root mean squared promised standard deviation.
        coverage_95: Share of runs whose 95 % interval holds the truth [-].
    """

    name: str
    unit: str
    n: int
    bias: float
    rmse: float
    sigma: float
    coverage_95: float


@dataclass(frozen=True)
class Level:
    """All runs of one value of what is varied.

    Attributes:
        value: Of the varied path; empty where nothing is.
        n: Number of runs.
        calibrated: Share of runs with a result that may be used [-].
        detected: Share of all runs that show the calibrated model to be better [-].
        coverage_95: Mean share of intervals that hold the truth [-].
        nees_per_dof: Median [-]; 1 where the model is true.
        model_2_mm: Median held-out error per component [mm].
    """

    value: str
    n: int
    calibrated: Interval
    detected: Interval
    coverage_95: Interval
    nees_per_dof: float
    model_2_mm: float


def share(k: int, n: int) -> Interval:
    """k of n with its Clopper-Pearson interval."""
    found = stats.binomtest(k, n).proportion_ci(0.95, "exact")
    return Interval(k / n, float(found.low), float(found.high))


def mean(x: np.ndarray) -> Interval:
    """Mean of x (n,) with its Student interval; no interval from fewer than two."""
    if len(x) < 2:
        return Interval(float(x.mean()) if len(x) else np.nan, np.nan, np.nan)
    half = float(stats.t.ppf(0.975, len(x) - 1) * x.std(ddof=1) / np.sqrt(len(x)))
    return Interval(float(x.mean()), float(x.mean()) - half, float(x.mean()) + half)


def level(value: str, rows: Sequence[Row]) -> Level:
    """Summarise the runs of one value."""
    good = [{m.name: m.value for m in row.magnitudes} for row in rows if row.status == "ok"]

    def of(name: str) -> np.ndarray:
        return np.array([run[name] for run in good])

    return Level(
        value=value,
        n=len(rows),
        calibrated=share(len(good), len(rows)),
        detected=share(round(of("detected").sum()), len(rows)),
        coverage_95=mean(of("coverage_95")),
        nees_per_dof=float(np.median(of("nees_per_dof"))) if good else np.nan,
        model_2_mm=float(np.median(of("model_2_mm"))) if good else np.nan,
    )


def parameters(folder: Path, rows: Sequence[Row]) -> Iterator[Parameter]:
    """Each parameter and combination over the runs of a collection."""
    found: dict[tuple[str, str], list[tuple[float, float]]] = defaultdict(list)
    for row in rows:
        if row.status == "ok":
            text = (folder / "runs" / run_name(row.id) / "score.json").read_text(encoding="utf-8")
            content = json.loads(text)
            for p in (*content["parameters"], *content["combinations"]):
                if p["estimate"] is not None and p["sigma"] and p["truth"] is not None:
                    found[p["name"], p["unit"]].append((p["estimate"] - p["truth"], p["sigma"]))
    for (name, unit), values in found.items():
        error, sigma = np.array(values).T
        rmse, promised = np.sqrt((error**2).mean()), np.sqrt((sigma**2).mean())
        inside = float((np.abs(error) <= SPAN_95 * sigma).mean())
        yield Parameter(name, unit, len(values), float(error.mean()), float(rmse), float(promised), inside)


def save(path: Path, levels: Sequence[Level], found: Sequence[Parameter]) -> None:
    """Write study.json, whole or not at all."""
    content = {"schema": 1, "levels": [asdict(x) for x in levels], "parameters": [asdict(p) for p in found]}
    text = json.dumps(content, indent=1).replace("NaN", "null")
    write_whole(path, text + "\n")
