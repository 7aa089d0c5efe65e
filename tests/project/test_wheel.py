"""The built wheel, installed where the repository is not, has everything the README uses."""

import os
import site
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LINES = (
    "tiago-twin --version",
    "tiago-twin list",
    "tiago-twin show swing20 gap",
    "tiago-twin run short --quick --seed 3 --out runs/robot",
    "tiago-twin check runs/robot --max model_2.mm=4",
    "tiago-twin dataset swing20 -n 1 --out runs/swings",
)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """An environment with the wheel; its dependencies are those of the running one."""
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder], cwd=ROOT, check=True)
    subprocess.run([sys.executable, "-m", "venv", folder / "env"], check=True)
    packages = next((folder / "env").glob("lib/python*/site-packages"))
    (wheel,) = folder.glob("*.whl")
    subprocess.run([folder / "env/bin/pip", "install", "-q", "--no-deps", "--no-index", wheel], check=True)
    others = {sysconfig.get_path("purelib"), *site.getsitepackages()}
    (packages / "dependencies.pth").write_text("".join(f"import site; site.addsitedir({p!r})\n" for p in others))
    return folder / "env"


def environment(installed):
    names = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    return names | {"PATH": f"{installed / 'bin'}{os.pathsep}{names['PATH']}"}


def test_every_file_comes_from_the_wheel(installed, tmp_path):
    code = "import twin, mjcf, calibration, scenarios as s; print(*(m.__file__ for m in (twin, mjcf, calibration, s)))"
    options = {"cwd": tmp_path, "env": environment(installed), "check": True, "capture_output": True, "text": True}
    found = subprocess.run([installed / "bin/python", "-c", code], **options).stdout.split()
    assert all(path.startswith(str(installed)) for path in found)


def test_the_wheel_does_what_the_readme_shows(installed, tmp_path):
    options = {"cwd": tmp_path, "env": environment(installed), "capture_output": True, "text": True, "timeout": 900}
    for line in LINES:
        done = subprocess.run(line.split(), **options)
        assert done.returncode == 0, f"{line}\n{done.stderr[-2000:]}"
    page = (tmp_path / "runs/robot/report.html").read_text(encoding="utf-8")
    assert "badge" in page and (tmp_path / "runs/swings/index.csv").is_file()
