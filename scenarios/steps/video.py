"""Stills and clips of the trials of a simulated run, from its scenario and its truth."""

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.files.errors import ScenarioError

if TYPE_CHECKING:
    from twin.rendering import ClipOptions


def film(run_folder: Path | str, trial_id: str, out: Path | str, options: "ClipOptions") -> int:
    """Write a GIF of a trial, or a PNG of one instant where the duration is 0; return the number of pictures.

    Raises:
        ScenarioError: The folder is not a simulated run, has no such trial, or `out` cannot be written.
        TwinError: The trial has nothing at that time, or the driver asked for is not there.
    """
    run_folder, out = Path(run_folder), Path(out)
    role = _role(run_folder, trial_id)

    from scenarios.steps.run_steps import load
    from twin import truth
    from twin.campaign import laboratory, second_session
    from twin.rendering import clip

    scenario = load(run_folder / "scenario.yaml")
    lab = laboratory(scenario.twin, scenario.seed)
    lab = second_session(lab) if role == "confirmation" else lab
    part = out.with_name(f".{out.name}.part")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        n = clip(lab, truth.read_trial(run_folder / "truth" / "trials" / f"{trial_id}.nc"), part, options)
        os.replace(part, out)
    except OSError as error:
        raise ScenarioError(f"{out}: cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)
    return n


def _role(run_folder: Path, trial_id: str) -> str:
    """The session a trial belongs to."""
    for name in ("scenario.yaml", "dataset/dataset.json", "truth/trials"):
        if not (run_folder / name).exists():
            raise ScenarioError(f"{run_folder}: holds no {name}; a picture is made of a run that was simulated here")
    trials = json.loads((run_folder / "dataset" / "dataset.json").read_text(encoding="utf-8"))["trials"]
    roles = {str(t["id"]): str(t["role"]) for t in trials}
    if trial_id not in roles:
        raise ScenarioError(f"{run_folder}: no trial {trial_id!r}; its trials are {', '.join(roles)}")
    return roles[trial_id]
