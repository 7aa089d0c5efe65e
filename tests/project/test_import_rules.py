"""Who may import whom: the table `import_rules.toml`, read by import-linter."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
RULES = Path(__file__).with_name("import_rules.toml")
PACKAGES = ("calibration", "mjcf", "scenarios", "twin")


def broken(tree: Path) -> set[str]:
    """Names of the rules that the packages under `tree` break."""
    command = [Path(sys.executable).with_name("lint-imports"), "--config", RULES, "--no-cache"]
    done = subprocess.run(command, cwd=tree, capture_output=True, text=True)
    found = re.findall(r"^(.+) (KEPT|BROKEN)(?: \(.*\))?$", done.stdout, re.MULTILINE)
    names = {name for name, verdict in found if verdict == "BROKEN"}
    assert found, done.stdout
    assert (done.returncode == 0) == (names == set()), done.stdout
    return names


def test_every_import_follows_the_rules():
    assert broken(ROOT) == set()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "line", "rule"),
    [
        ("calibration/stages/geometry/stage.py", "import mujoco", "calibration knows no simulator"),
        ("calibration/robot/chain.py", "def f():\n    import twin", "calibration knows no simulator"),
        ("twin/errors.py", "from calibration.numerics import lie", "the recording format alone"),
        ("twin/errors.py", "from calibration.recording.trial import Trial", "reaches past a package of calibration"),
        (
            "scenarios/steps/run_steps.py",
            "from calibration.stages.geometry.stage import calibrate_geometry",
            "reaches past a package of calibration",
        ),
        ("scenarios/errors.py", "from twin.config.twin import TwinConfig", "reaches past a package of the twin"),
        ("calibration/mocap/labels.py", "from calibration.estimate import Estimate", "Layers of calibration"),
        (
            "calibration/robot/hand.py",
            "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from calibration.mocap import Postures",
            "Layers of calibration",
        ),
        ("mjcf/nominal.py", "from mjcf.urdf_export import urdf", "No circles"),
    ],
)
def test_a_wrong_import_is_seen(tmp_path, file, line, rule):
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    with (tmp_path / file).open("a", encoding="utf-8") as changed:
        changed.write(f"\n{line}\n")
    assert any(rule in name for name in broken(tmp_path))
