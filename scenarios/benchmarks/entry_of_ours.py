"""Our own calibration as an entry, from the blind datasets alone: the rows of the ladder are the baselines."""

import json
from pathlib import Path

from scenarios import steps
from scenarios.benchmarks.frozen import robots
from scenarios.benchmarks.tasks import TASKS
from scenarios.datasets.index import write_whole


def calibrate(bench: Path, out: Path, tier: str, progress: steps.Progress) -> tuple[str, ...]:
    """Write the entry folder `out`, resuming what is there; return what has no estimate, and why."""
    from calibration import CalibrationError

    out.mkdir(parents=True, exist_ok=True)
    todo = [(task.name, robot.name) for robot in robots(tier) for task in TASKS]
    failed = []
    for k, (task, robot) in enumerate(todo):
        progress("benchmark", f"{task}, {robot}", k / len(todo))
        if (out / task / robot / "estimate.json").is_file():
            continue
        try:
            steps.calibrate(bench / "data" / task / robot, out / task / robot)
        except CalibrationError as error:
            failed.append(f"{task}, {robot}: {error}")
    about = {"name": "tiago-twin", "method": "tiago-twin calibrate", "truth_not_used": True}
    write_whole(out / "entry.json", json.dumps(about, indent=1) + "\n")
    return tuple(failed)
