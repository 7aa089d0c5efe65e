"""A task as its participants get it: a dataset folder whose held-out trials show no hand.

Of held-out trials the markers of hand and shoulder and the link encoders are left out, in tasks that predict the base
its markers after the first second, too. Everything else is as recorded.
"""

import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np

from calibration import Dataset
from calibration.recording import Trial, write_trial
from scenarios.benchmarks.tasks import Task, held_out
from scenarios.files import output_folder

_REST = 1.0  # [s] at the start of every trial


def write_blind(dataset: Dataset, task: Task, out: Path) -> None:
    """Write the dataset folder of a task; files that stay as they are share their bytes with the whole dataset.

    Raises:
        ScenarioError: `out` must not be overwritten.
    """
    seen, entries = task.of(dataset), []
    with output_folder.replacing(out, output_folder.DATASET) as new:
        (new / "trials").mkdir(parents=True)
        for entry in seen.description.trials:
            if held_out(entry):
                entry = entry.model_copy(
                    update={"sha256": write_trial(new / entry.file, _hidden(dataset, task, entry.id))}
                )
            else:
                _link(dataset.folder / entry.file, new / entry.file)
            entries.append(entry)
        text = seen.description.model_copy(update={"trials": tuple(entries)}).model_dump_json(indent=1)
        (new / "dataset.json").write_text(text + "\n", encoding="utf-8")
        (new / "nominal.urdf").write_text(dataset.urdf, encoding="utf-8")


def _hidden(dataset: Dataset, task: Task, name: str) -> Trial:
    trial = dataset.read(next(t for t in dataset.description.trials if t.id == name))
    p, base = trial.marker_position.copy(), dataset.description.base_body.name
    p[:, np.array(trial.marker_body) != base] = np.nan
    if not task.base:
        p[trial.t_mocap > trial.t_mocap[0] + _REST] = np.nan
    return replace(trial, marker_position=p, q_link=np.full_like(trial.q_link, np.nan))


def _link(source: Path, target: Path) -> None:
    try:
        os.link(source, target)
    except OSError:  # another file system
        shutil.copyfile(source, target)
