"""Stills and clips of the trials of a simulated run, from its scenario and its truth."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from calibration.untrusted import read_json
from scenarios.files.errors import ScenarioError
from scenarios.files.output_folder import one_file

if TYPE_CHECKING:
    from twin.rendering import ClipOptions


def film(
    run_folder: Path | str,
    trial_id: str,
    out: Path | str,
    options: "ClipOptions",
    progress: Callable[[float], None] = lambda _: None,
) -> int:
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
    with one_file(out) as part:
        true = truth.read_trial(run_folder / "truth" / "trials" / f"{trial_id}.nc")
        return clip(lab, true, part, options, progress)


def _role(run_folder: Path, trial_id: str) -> str:
    """The session a trial belongs to."""
    for name in ("scenario.yaml", "dataset/dataset.json", "truth/trials"):
        if not (run_folder / name).exists():
            raise ScenarioError(f"{run_folder}: contains no {name}; pictures need a run simulated here")
    content = read_json(run_folder / "dataset" / "dataset.json")
    trials = content.get("trials") if isinstance(content, dict) else None
    roles = {str(t.get("id")): str(t.get("role")) for t in trials or () if isinstance(t, dict)}
    if trial_id not in roles:
        raise ScenarioError(f"{run_folder}: no trial {trial_id!r}; its trials are {', '.join(roles)}")
    return roles[trial_id]
