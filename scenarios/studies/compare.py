"""Paired comparison over robots: the same robots calibrated in two ways, figure by figure.

    d_i = b_i - a_i,    mean d +- t_{0.975, n-1} s_d / sqrt(n)        share with b_i < a_i: Clopper and Pearson

A folder is a study of `study coverage` or `study power`, paired by the run's number under one root seed, or scores of
`benchmark score` with one entry, paired by robot and task.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenarios.datasets.reader import open_collection
from scenarios.files.errors import ScenarioError
from scenarios.studies.statistics import Interval, mean, share

SCORES = "scores.json"


@dataclass(frozen=True)
class Difference:
    """A figure of two folders over the robots that both have.

    Attributes:
        folder: The second one; the first is what it is compared with.
        figure: Name of the figure, its unit at the end.
        n: Number of robots.
        first: Mean of the first.
        second: Mean of the second.
        difference: Mean of second minus first.
        smaller: Share of robots with the second smaller [-].
    """

    folder: str
    figure: str
    n: int
    first: float
    second: float
    difference: Interval
    smaller: Interval


def compare(folders: Sequence[Path]) -> tuple[Difference, ...]:
    """Every folder with the first one, figure by figure.

    Raises:
        ScenarioError: Fewer than two folders, no common figure or robot, or other robots.
    """
    if len(folders) < 2:
        raise ScenarioError("study compare: name two folders or more, the reference first")
    (series, first), *others = [_figures(folder) for folder in folders]
    found = []
    for folder, (theirs, second) in zip(folders[1:], others, strict=True):
        if theirs != series:
            raise ScenarioError(f"{folder}: other robots than {folders[0]} ({theirs}, not {series}): not to be paired")
        pairs = [d for name in first if name in second and (d := _difference(folder, name, first, second)) is not None]
        if not pairs:
            raise ScenarioError(f"{folder}: no figure in common with {folders[0]} for two robots or more")
        found += pairs
    return tuple(found)


Figures = dict[str, dict[int, float]]
"""Values by name of the figure and number of the robot."""


def _difference(folder: Path, name: str, first: Figures, second: Figures) -> Difference | None:
    robots = sorted(first[name].keys() & second[name].keys())
    a, b = (np.array([of[name][robot] for robot in robots]) for of in (first, second))
    known = np.isfinite(a) & np.isfinite(b)
    a, b = a[known], b[known]
    if len(a) < 2:
        return None
    smaller = share(int((b < a).sum()), len(a))
    return Difference(str(folder), name, len(a), float(a.mean()), float(b.mean()), mean(b - a), smaller)


def _figures(folder: Path) -> tuple[str, Figures]:
    """Which robots they are of, and their figures."""
    if (folder / SCORES).is_file():
        return _of_scores(folder / SCORES)
    collection = open_collection(folder)
    about = json.loads((folder / "collection.json").read_text(encoding="utf-8"))
    found: Figures = {}
    for row in collection.rows:
        for magnitude in row.magnitudes if row.status == "ok" else ():
            found.setdefault(magnitude.name, {})[row.id] = magnitude.value
    return f"root seed {about.get('scenario', {}).get('seed')}", found


def _of_scores(path: Path) -> tuple[str, Figures]:
    content = json.loads(path.read_text(encoding="utf-8"))
    mine = [f for f in content["figures"] if f["main"]]
    entries = sorted({f["entry"] for f in mine})
    if len(entries) != 1:
        raise ScenarioError(f"{path}: has the entries {', '.join(entries) or '(none)'}; score one entry at a time")
    found: Figures = {}
    for figure in mine:
        for name, value in _values(figure):
            found.setdefault(name, {})[figure["robot"]] = value
    return str(content["benchmark"]), found


def _values(figure: dict[str, object]) -> Iterator[tuple[str, float]]:
    for name in ("mm", "deg", "again_mm", "zeros_mrad"):
        value = figure[name]
        if isinstance(value, float):
            yield f"{figure['task']}_{name}", value
