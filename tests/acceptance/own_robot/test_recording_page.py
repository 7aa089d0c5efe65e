"""Every command of docs/recording.md is run, in its order, on a small campaign's files and the public recordings."""

import glob
import json
import re
import shlex
from dataclasses import replace
from pathlib import Path

import pytest

from scenarios.commands import main
from scenarios.steps import import_export
from tests.doubles import rigid_robot

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs/recording.md").read_text(encoding="utf-8")
COMMANDS = [
    line.partition("  #")[0]
    for block in re.findall(r"```bash\n(.*?)```", PAGE, re.DOTALL)
    for line in block.splitlines()
    if line.startswith("tiago-twin ")
]

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A working folder with a campaign, its estimate to come, its exports, and the documents."""
    work = tmp_path_factory.mktemp("page")
    (work / "runs/x").mkdir(parents=True)
    truth = replace(rigid_robot.defects(1), plate=(-2.7, 0.0))  # C3D has one ratio of rates
    rigid_robot.campaign(work / "runs/x/dataset", truth, n_postures=20)
    for name, kind in (("session", "csv"), ("c3d", "c3d"), ("bags", "bag")):
        import_export.export_files(kind, work / "runs/x/dataset", work / name)
    for name in ("tests", "docs"):
        (work / name).symlink_to(ROOT / name)
    return work


def run(command: str) -> int:
    """Exit code of a command line, its patterns filled in as a shell does."""
    words = [w for word in shlex.split(command)[1:] for w in (sorted(glob.glob(word)) if "*" in word else [word])]
    with pytest.raises(SystemExit) as exit:
        main.main(words)
    return int(exit.value.code or 0)


def test_every_command_of_the_page_runs(folder, monkeypatch):
    monkeypatch.chdir(folder)
    assert len(COMMANDS) >= 15
    for command in COMMANDS:
        if "export urdf" in command:
            assert run("tiago-twin calibrate runs/x/dataset --out runs/x/estimate") == 0
        assert run(command) == 0, command
    verdicts = json.loads((folder / "runs/arm/estimate/estimate.json").read_text())["verdicts"]
    (said,) = [v["message"] for v in verdicts if "left-out postures" in v["message"]]
    error, alone = (float(said.split(word)[1].split()[0]) for word in ("left-out postures ", "registration "))
    assert error == pytest.approx(0.10, abs=0.02) and alone == pytest.approx(4.8, abs=0.1)


def test_a_suspension_is_no_calibrated_robot(tmp_path, capsys):
    mapping = ROOT / "docs/mappings/vicon_forceplate.yaml"
    import_export.import_files("csv", [ROOT / "tests/data/vicon_forceplate_2023-09-20.csv"], mapping, tmp_path / "d")
    assert run(f"tiago-twin calibrate {tmp_path / 'd'} --out {tmp_path / 'estimate'}") == 0
    assert not (tmp_path / "estimate/calibrated.urdf").exists()
    assert run(f"tiago-twin export urdf {tmp_path / 'estimate'} --out {tmp_path / 'robot.urdf'}") == 1
    assert "no geometry in this estimate" in capsys.readouterr().err
