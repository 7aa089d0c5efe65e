"""Making the benchmark: robots simulated, blind datasets written, both compared with what is frozen.

OUT/truth/runs/<id>/{dataset, truth}      a collection of whole runs, for scoring; participants leave it alone
OUT/data/<task>/robot_NN/                 dataset folders without truth
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from scenarios.benchmarks.blind import write_blind
from scenarios.benchmarks.frozen import Robot, differences, frozen_digests, robots, scenario_digests, truth_digest
from scenarios.benchmarks.tasks import TASKS
from scenarios.datasets.collection import Plan, Progress, collect
from scenarios.datasets.reader import Run, open_collection
from scenarios.datasets.run_content import recordings_and_truth
from scenarios.datasets.run_spec import Order
from scenarios.datasets.workers import Workers


@dataclass(frozen=True)
class Robots(Plan):
    """A collection whose runs are the robots of the benchmark."""

    robots: tuple[Robot, ...] = ()

    def orders(self) -> Iterator[Order]:
        """One for each robot, from its own scenario."""
        for order, robot in zip(super().orders(), self.robots, strict=True):
            yield replace(order, scenario=robot.series().model_dump_json())


def make(tier: str, out: Path, workers: Workers, progress: Progress) -> tuple[str, ...]:
    """Make a tier of the benchmark in a folder, resuming what is there; return how it differs from the frozen one.

    Raises:
        ScenarioError: The folder is not of this benchmark, or there is no such tier.
    """
    chosen = robots(tier)
    plan = Robots(chosen[0].series(), len(chosen), out / "truth", recordings_and_truth, robots=chosen)
    rows = collect(plan, workers, progress)
    found = [f"{robot.name}: {row.status}, {row.reason}" for robot, row in zip(chosen, rows, strict=True) if row.reason]
    if scenario_digests() != frozen_digests():
        found.append("the scenario files are not the frozen ones")
    for robot, run in runs(tier, out):
        found += differences(robot, run.dataset)
        if truth_digest(robot) != robot.truth:
            found.append(
                f"{robot.name}: its truth is not the frozen one; install the release that scores are compared of"
            )
        for task in TASKS:
            if not (out / "data" / task.name / robot.name / "dataset.json").is_file():
                write_blind(run.dataset, task, out / "data" / task.name / robot.name)
    return tuple(found)


def runs(tier: str, out: Path) -> Iterator[tuple[Robot, Run]]:
    """The robots that were made, and where.

    Raises:
        ScenarioError: Nothing was made there.
    """
    known = {robot.id: robot for robot in robots(tier)}
    for run in open_collection(out / "truth").runs():
        if run.row.id in known:
            yield known[run.row.id], run
