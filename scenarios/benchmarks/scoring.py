"""Scoring entries: the held-out hand first, then parameters and their intervals, robot by robot.

    ENTRY/entry.json                       {"name": ..., "method": ..., "truth_not_used": true}
    ENTRY/<task>/robot_NN{/, .json, .urdf with .zeros.yaml or .zeros.csv, .csv, .nc}      as `evaluate` takes them

Rows of a figure are RMSE of the hand's position per component against the truth, on motions no entry has seen.
"""

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from calibration import Evaluation
from scenarios.benchmarks.frozen import Robot
from scenarios.benchmarks.make import runs
from scenarios.benchmarks.tasks import TASKS, Task
from scenarios.datasets.index import write_whole
from scenarios.datasets.reader import Run
from scenarios.files.errors import ScenarioError
from scenarios.score.score import Score
from scenarios.score.score import score as judged
from scenarios.steps import Progress, evaluated
from scenarios.studies.statistics import mean

NOMINAL, FLOOR = "nominal", "floor"
_SUFFIXES = ("", ".json", ".urdf", ".csv", ".nc")


@dataclass(frozen=True)
class Figure:
    """What a model of an entry scored with one robot in one task; NaN where it has no such figure.

    Attributes:
        entry: Name of the entry; empty for the nominal robot and the floor.
        model: Row of the ladder; empty where the entry has one of its own.
        task: Name of the task.
        robot: Number of the robot.
        main: Whether it is what the entry delivers.
        mm: RMSE of the hand's position per component [mm].
        deg: RMSE of its orientation [deg].
        again_mm: As `mm`, in the second session, against the motion capture.
        zeros_mrad: RMSE of the arm's encoder zeros [mrad].
        covered: Share of 95 % intervals that contain the truth, of the entry's main model.
    """

    entry: str
    model: str
    task: str
    robot: int
    main: bool
    mm: float
    deg: float
    again_mm: float = np.nan
    zeros_mrad: float = np.nan
    covered: float = np.nan


@dataclass(frozen=True)
class Entry:
    """A submission that was opened."""

    folder: Path
    name: str

    def file(self, task: Task, robot: Robot) -> Path | None:
        """What it has for a robot in a task."""
        places = (self.folder / task.name / f"{robot.name}{suffix}" for suffix in _SUFFIXES)
        return next((path for path in places if path.exists()), None)


def open_entry(folder: Path) -> Entry:
    """Read entry.json.

    Raises:
        ScenarioError: It is missing or does not declare how it was made.
    """
    path = folder / "entry.json"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ScenarioError(f"{path}: not an entry ({error}); see docs/benchmark.md") from error
    if not isinstance(content, dict) or not content.get("name") or content.get("truth_not_used") is not True:
        raise ScenarioError(f'{path}: needs "name", and "truth_not_used": true')
    return Entry(folder, str(content["name"]))


def score(entries: Sequence[Path], bench: Path, out: Path, tier: str, progress: Progress) -> tuple[str, ...]:
    """Write OUT/scores.json and OUT/scores.md; return warnings of what is missing, doubtful or was rejected.

    Raises:
        ScenarioError: There is no benchmark or no entry.
    """
    opened = [open_entry(folder) for folder in entries]
    pairs = list(runs(tier, bench))
    todo = [(e, task, robot, run) for e in opened for task in TASKS for robot, run in pairs]
    by_name: dict[tuple[str, str, str, int], Figure] = {}
    warnings = []
    for k, (entry, task, robot, run) in enumerate(todo):
        progress("score", f"{entry.name}, {task.name}, {robot.name}", k / len(todo))
        path = entry.file(task, robot)
        if path is None:
            warnings.append(f"{entry.name}: nothing for {task.name}, {robot.name}")
            continue
        try:
            scored, evaluation = _judged(task, run, path)
            for figure in _figures(entry, task, robot, path.stem, scored, evaluation):
                by_name.setdefault((figure.entry, figure.model, figure.task, figure.robot), figure)  # nominal once
            own = tuple(f"{row.model}: " for row in evaluation.rows)
            doubts = (v.message for v in evaluation.verdicts if v.verdict == "warning" and v.message.startswith(own))
            warnings += [f"{entry.name}, {task.name}, {robot.name}: {text}" for text in doubts]
        except _rejections() as error:
            warnings.append(f"{entry.name}, {task.name}, {robot.name}: rejected: {error}")
    out.mkdir(parents=True, exist_ok=True)
    found = tuple(by_name.values())
    content = {"benchmark": "bench-v1", "tier": tier, "figures": [_plain(f) for f in found]}
    write_whole(out / "scores.json", json.dumps(content, indent=1) + "\n")
    write_whole(out / "scores.md", table(found, len(pairs)))
    return tuple(warnings)


def _rejections() -> tuple[type[Exception], ...]:
    from calibration import CalibrationError

    return CalibrationError, ScenarioError


def _judged(task: Task, run: Run, path: Path) -> tuple[Score, Evaluation]:
    zeros = next((z for suffix in ("yaml", "csv") if (z := path.with_suffix(f".zeros.{suffix}")).is_file()), None)
    estimate, evaluation = evaluated(path, task.of(run.dataset), zeros)
    return judged(estimate, evaluation, run.folder / "truth"), evaluation


def _figures(  # noqa: PLR0913
    entry: Entry, task: Task, robot: Robot, file: str, scored: Score, evaluation: Evaluation
) -> Iterator[Figure]:
    for model in dict.fromkeys(row.model for row in scored.rows):
        row = task.row(scored.rows, model)
        if row is None:
            continue
        again = task.row(evaluation.confirmation, model) if task.sessions else None
        own = model not in (NOMINAL, FLOOR)
        yield Figure(
            entry.name if own else "",
            "" if model == file else model,  # named after its file
            task.name,
            robot.id,
            model in (scored.main, file),
            row.metrics.position_rmse_component_mm,
            row.metrics.orientation_rmse_deg,
            np.nan if again is None else again.metrics.position_rmse_component_mm,
            _zeros(scored, model) if own else np.nan,
            scored.coverage_95 if model == scored.main else np.nan,
        )


def _zeros(scored: Score, model: str) -> float:
    """RMSE of a model's encoder zeros of the arm [mrad]."""
    judged = dict(scored.models).get(model)
    errors = [
        p.estimate - p.truth
        for p in (judged.parameters if judged else ())
        if p.name.startswith("encoder.arm_") and p.name.endswith(".motor.offset") and np.isfinite(p.estimate)
    ]
    return 1e3 * float(np.sqrt(np.mean(np.square(errors)))) if errors else np.nan


def table(found: Sequence[Figure], robots: int) -> str:
    """Markdown: a line for each model of each entry, means over robots; the best of a task first in `all`."""
    names = [task.name for task in TASKS]
    lines = [
        f"| entry | {' | '.join(f'{n} [mm]' for n in names)} | all [deg] | second session [mm] | zeros [mrad] "
        "| intervals that cover |",
        f"|---|{'---|' * (len(names) + 4)}",
    ]
    rows = {}
    for key in dict.fromkeys((f.entry, f.model) for f in found):
        mine = [f for f in found if (f.entry, f.model) == key]
        of = {n: [f for f in mine if f.task == n] for n in names}
        last = of["all"]
        cells = [_cell([f.mm for f in of[n]], robots, ".2f") for n in names]
        cells += [_cell([f.deg for f in last], robots, ".2f"), _cell([f.again_mm for f in last], robots, ".2f")]
        cells += [_cell([f.zeros_mrad for f in last], robots, ".1f"), _cell([f.covered for f in last], robots, ".2f")]
        order = float(np.mean([f.mm for f in last])) if last else np.inf
        rows[f"| {': '.join(filter(None, key))} | {' | '.join(cells)} |"] = order
    return "\n".join([*lines, *sorted(rows, key=lambda r: -rows[r])]) + "\n"


def _cell(values: Iterable[float], robots: int, form: str) -> str:
    """Mean of what is known, with its 95 % interval's half width; how many robots, where it is not all."""
    known = np.array([v for v in values if np.isfinite(v)])
    if not len(known):
        return "-"
    found = mean(known)
    half = f" ± {found.high - found.value:{form}}" if np.isfinite(found.high) else ""
    return f"{found.value:{form}}{half}" + ("" if len(known) == robots else f" ({len(known)} of {robots})")


def _plain(figure: Figure) -> dict[str, object]:
    return {k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in asdict(figure).items()}
