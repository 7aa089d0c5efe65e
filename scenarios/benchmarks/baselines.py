"""Baselines as entries, from the blind datasets alone: our own calibration, the rows of its ladder; and the peer's."""

import json
from pathlib import Path

from scenarios import steps
from scenarios.benchmarks.frozen import robots
from scenarios.benchmarks.peer import Peer, predict_dataset
from scenarios.benchmarks.tasks import TASKS
from scenarios.datasets.index import write_whole
from scenarios.files.errors import ScenarioError


def calibrate(bench: Path, out: Path, tier: str, progress: steps.Progress, peer: Peer | None = None) -> tuple[str, ...]:
    """Write the entry folder `out` of ours or the peer, resuming what is there; return what is not in it, and why."""
    from calibration import CalibrationError

    out.mkdir(parents=True, exist_ok=True)
    todo = [(task.name, robot.name) for robot in robots(tier) for task in TASKS]
    failed = []
    for k, (task, robot) in enumerate(todo):
        progress("benchmark", f"{task}, {robot}", k / len(todo))
        data, place = bench / "data" / task / robot, out / task / robot
        if (place / "estimate.json").is_file() or place.with_suffix(".nc").is_file():
            continue
        try:
            if peer is None:
                steps.calibrate(data, place)
            else:
                place.parent.mkdir(exist_ok=True)
                predict_dataset(peer, data, place.with_suffix(".nc"))
        except (CalibrationError, ScenarioError) as error:
            failed.append(f"{task}, {robot}: {error}")
    name, method = ("tiago-twin", "tiago-twin calibrate") if peer is None else ("FIGAROH 1.0.2", peer.method)
    about = {"name": name, "method": method, "truth_not_used": True}
    write_whole(out / "entry.json", json.dumps(about, indent=1) + "\n")
    return tuple(failed)
