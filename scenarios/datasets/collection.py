"""A collection: many runs of one scenario in one folder, resumable.

    OUT/collection.json  index.csv  datasheet.md  runs/<id>/

A run appears in runs/ when it is complete; the index is written from what is there. Whatever stops the work, the
same command goes on where it stopped and ends with the same bytes.
"""

import json
import os
import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from calibration.untrusted import read_json
from scenarios.datasets import datasheet
from scenarios.datasets.index import Row, write_index, write_whole
from scenarios.datasets.run_one import PARTIAL, perform
from scenarios.datasets.run_spec import Order, Produce, digest_of, run_name
from scenarios.datasets.workers import Done, NoRoom, Task, Workers, compute
from scenarios.files import output_folder as folder
from scenarios.files.errors import ScenarioError
from scenarios.files.scenario import Scenario
from scenarios.steps import versions

COLLECTION = folder.Kind(
    "collection", "collection.json", frozenset({"collection.json", "index.csv", "datasheet.md", "runs", "study.json"})
)
Progress = Callable[[str, float], None]
"""Called with what it is at, and the share of the runs that is done [-]."""


@dataclass(frozen=True)
class Plan:
    """What a collection is to hold.

    Attributes:
        scenario: What each run is a draw of; its seed is the root of theirs.
        n: Number of runs, 0 to n - 1.
        folder: Where it goes.
        produce: What makes a run.
        blind: Whether scenario and seed are left out of the folder.
    """

    scenario: Scenario
    n: int
    folder: Path
    produce: Produce
    blind: bool = False

    @property
    def digest(self) -> str:
        """Of all that decides the bytes of a run."""
        return digest_of(self.scenario, self.produce, tuple(sorted(versions().items())))

    def orders(self) -> Iterator[Order]:
        """One for each run."""
        text, digest, place = self.scenario.model_dump_json(), self.digest, self.folder.resolve()
        return (Order(i, place, text, self.produce, digest) for i in range(self.n))


def collect(
    plan: Plan,
    workers: Workers,
    progress: Progress,
    task: Task = perform,
    announce: Callable[[str], None] = lambda cost: None,
) -> tuple[Row, ...]:
    """Make the runs that are missing or not right; return the rows of all; announce bytes and time after the first.

    Raises:
        ScenarioError: The folder is not such a collection, or somebody else is writing it.
        NoRoom: The disk is full, or too small for what is to come; what is complete stays.
    """
    _check_place(plan)
    plan.folder.mkdir(parents=True, exist_ok=True)
    with folder.locked(os.open(plan.folder, os.O_RDONLY), plan.folder):
        _clear_partial(plan.folder)
        (plan.folder / "runs").mkdir(exist_ok=True)
        write_whole(plan.folder / "collection.json", _description(plan))
        rows: list[Row] = []
        try:
            for row in _reported(compute(plan.orders(), workers, task), plan, workers, progress, announce):
                rows.append(row)
        finally:
            write_index(plan.folder / "index.csv", rows)
        write_whole(plan.folder / "datasheet.md", datasheet.text(plan.folder, rows))
    return tuple(sorted(rows, key=lambda row: row.id))


def _reported(
    done: Iterator[Done], plan: Plan, workers: Workers, progress: Progress, announce: Callable[[str], None]
) -> Iterator[Row]:
    """Pass the rows on; state from the first new one what the others will cost, then the rate and the time left."""
    progress("timing the first run", 0.0)
    there = {path.name for path in (plan.folder / "runs").iterdir()}  # checked, not made: they say nothing of the time
    start, width, made = time.monotonic(), max(1, workers.number), 0
    for k, one in enumerate(done, 1):
        yield one.row
        left, is_new = plan.n - k, run_name(one.row.id) not in there
        made += is_new
        if made == 1 and is_new:
            _check_room(plan.folder, one.row.bytes * left)
            size = f"{_bytes(one.row.bytes * plan.n)} in all, {_hours(one.seconds * left / width)}"
            announce(f"{size} left with {width} worker{'s' if width > 1 else ''}")
            start = time.monotonic()
        elif made:
            rate = max(made - 1, 1) / (time.monotonic() - start)
            progress(f"{k} of {plan.n} runs, {rate:.2g} a second, {_hours(left / rate)} left", k / plan.n)


def _check_room(place: Path, needed: int) -> None:
    free = shutil.disk_usage(place).free
    if needed > free:
        raise NoRoom(
            f"{place}: the runs to come need {_bytes(needed)}, {_bytes(free)} are free; fewer runs, or more room"
        )


def _bytes(n: float) -> str:
    power = min(4, max(0, (len(str(int(n))) - 1) // 3))
    return f"{n / 1000**power:.3g} {('B', 'kB', 'MB', 'GB', 'TB')[power]}"


def _hours(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


def _check_place(plan: Plan) -> None:
    folder.check_replaceable(plan.folder.resolve(), COLLECTION)
    path = plan.folder / "collection.json"
    if not path.is_file():
        return
    there = read_json(path)
    if not isinstance(there, dict) or not {"digest", "name", "versions", "n"} <= there.keys():
        raise ScenarioError(f"{path}: is no collection's; name another --out, or move it away")
    if there["digest"] != plan.digest:
        raise ScenarioError(
            f"{plan.folder}: holds a collection of another scenario, seed, kind or version ({there['name']}, "
            f"{there['versions']}); name another --out"
        )
    if there["n"] > plan.n:
        raise ScenarioError(f"{plan.folder}: holds {there['n']} runs; -n {plan.n} would drop some, name another --out")


def _description(plan: Plan) -> str:
    scenario = plan.scenario
    content = {
        "schema": 1,
        "name": scenario.name,
        "description": scenario.description,
        "n": plan.n,
        "produce": plan.produce.__name__,
        "blind": plan.blind,
        "digest": plan.digest,
        "versions": versions(),
    }
    if not plan.blind:
        content |= {
            "scenario": scenario.model_dump(mode="json"),
            "seeds": "SeedSequence(scenario.seed, spawn_key=(id,))",
        }
    return json.dumps(content, indent=1) + "\n"


def _clear_partial(place: Path) -> None:
    """Remove what a killed command or worker left half-written."""
    for path in (*place.glob(f".*{PARTIAL}"), *(place / "runs").glob(f".*{PARTIAL}")):
        shutil.rmtree(path) if path.is_dir() else path.unlink()
