"""A small laboratory on disk for the hostile cases: made once, copied for each.

data/    a dataset of a rigid robot: four static postures, sweeps, a swing; validation
run/     results of a small run, made up       lab.yaml, csv/    the data as CSV with its mapping
"""

import hashlib
import importlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import netCDF4

from scenarios.steps import import_export
from tests.doubles import rigid_robot, run_folder

_HEAVY = ("calibration.pipeline", "calibration.evaluation", "scenarios.report", "scenarios.quicklook.page",
          "scenarios.commands.console", "twin.campaign", "twin.rendering", "ezc3d")  # fmt: skip

Change = Callable[[netCDF4.Dataset], None]


def make(folder: Path, n_postures: int = 4) -> Path:
    """Write the laboratory into a folder, and import once what each child would."""
    for name in _HEAVY:
        importlib.import_module(name)
    rigid_robot.campaign(folder / "data", rigid_robot.defects(1), n_postures=n_postures)
    _only(folder / "data", ("postures", "swing", "xyz"))
    run = folder / "run"
    run.mkdir()
    run_folder.write_dataset(run / "dataset")
    run_folder.write_estimate(run / "estimate")
    run_folder.write_evaluation(run)
    run_folder.write_score(run)
    (run / "scenario.yaml").write_text(run_folder.SCENARIO)
    shutil.copytree(folder / "data", folder / "one")
    _only(folder / "one", ("swing",))
    import_export.export_files("csv", folder / "one", folder / "csv")
    (folder / "scenario.yaml").write_text("name: mine\ndescription: one\nextends: short\nset: {seed: 4}\n")
    return folder


def make_formats(folder: Path) -> Path:
    """Add c3d/, bag/, an estimate of data/ and a plan of experiments, for fuzzing."""
    import calibration
    from calibration.formats.c3d.write import write_c3d
    from scenarios.files import registry
    from scenarios.steps import run_steps
    from tests.doubles import c3d_data

    (folder / "c3d").mkdir()
    write_c3d(folder / "c3d/log.c3d", c3d_data.trial(), c3d_data.described(), c3d_data.DEPTH)
    (folder / "c3d/mapping.yaml").write_text(json.dumps(c3d_data.mapping()))
    import_export.export_files("bag", folder / "one", folder / "bag")
    rigid_robot.campaign(folder / "more", rigid_robot.defects(1))
    run_steps.calibrate(folder / "more", folder / "estimate", plan_next=True)
    shutil.rmtree(folder / "more")
    plan = folder / "estimate/record_next.yaml"
    shutil.copy(plan, folder / "plan.yaml")
    shutil.copy(registry.HERE / "humanoids2024.yaml", folder / "humanoids2024.yaml")
    assert calibration.load_estimate(folder / "estimate").calibrated
    return folder


def copied(laboratory: Path, folder: Path) -> Path:
    """A copy to spoil."""
    shutil.copytree(laboratory, folder)
    return folder


def trial(name: str, change: Change) -> Callable[[Path], None]:
    """Change the file of a trial of data/ in place, its checksum renewed."""

    def spoil(folder: Path) -> None:
        with netCDF4.Dataset(folder / f"data/trials/{name}.nc", "r+") as file:
            change(file)
        renew(folder)

    return spoil


def values(name: str, variable: str, change: Callable) -> Callable[[Path], None]:
    """Change an array of a trial of data/ in place."""

    def set_values(file: netCDF4.Dataset) -> None:
        file.set_auto_mask(False)
        found = file.variables[variable][...]
        file.variables[variable][...] = change(found.copy())

    return trial(name, set_values)


def renew(folder: Path, data: str = "data") -> None:
    """Put the checksums of the trials' files into dataset.json."""
    path = folder / data / "dataset.json"
    listed = json.loads(path.read_text())
    for entry in listed["trials"]:
        entry["sha256"] = hashlib.sha256((folder / data / entry["file"]).read_bytes()).hexdigest()
    path.write_text(json.dumps(listed))


def _only(data: Path, names: tuple[str, ...]) -> None:
    listed = json.loads((data / "dataset.json").read_text())
    listed["trials"] = [entry for entry in listed["trials"] if entry["id"] in names]
    (data / "dataset.json").write_text(json.dumps(listed))
    for path in (data / "trials").iterdir():
        if path.stem not in names:
            path.unlink()
