"""The built wheel, installed where the repository is not, does every line of the README."""

import json
import os
import site
import subprocess
import sys
import sysconfig
from importlib.util import find_spec

import pytest

from tests.project.test_documents_run import DRIVER, ROOT, blocks

LINES = (
    "tiago-twin --version",
    "tiago-twin run short --quick --seed 3 --out runs/run",
)  # README's `make demo`, smaller
EMPTY = "TIAGO_TWIN_EMPTY_ENVIRONMENT"  # set: its dependencies, extra `view` too, are installed from a package index

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """An environment with the wheel; its dependencies are those of the running one, unless `EMPTY` is set."""
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder], cwd=ROOT, check=True)
    subprocess.run([sys.executable, "-m", "venv", folder / "env"], check=True)
    packages = next((folder / "env").glob("lib/python*/site-packages"))
    (wheel,) = folder.glob("*.whl")
    if os.environ.get(EMPTY):
        subprocess.run([folder / "env/bin/pip", "install", "-q", f"{wheel}[view]", "pytest"], check=True)
        return folder / "env"
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
    for name in ("tests/data", "docs/mappings"):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / ".venv").symlink_to(installed)
    view = ("tiago-twin view runs/run",) if os.environ.get(EMPTY) or find_spec("viser") else ()
    lines = [*blocks("README.md"), *(("bash", line) for line in (*LINES, *view))]
    options = {"cwd": tmp_path, "env": environment(installed), "capture_output": True, "text": True, "timeout": 900}
    done = subprocess.run([installed / "bin/python", "-c", DRIVER], input=json.dumps(lines), **options)
    assert done.returncode == 0, f"{done.stdout[-500:]}\n{done.stderr[-3000:]}"
    assert "badge" in (tmp_path / "runs/run/report.html").read_text(encoding="utf-8")


def test_its_fixtures_work_in_a_project_whose_packages_have_the_same_names(installed, tmp_path):
    (tmp_path / "calibration").mkdir()
    (tmp_path / "calibration/__init__.py").touch()
    (tmp_path / "test_mine.py").write_text("def test_mine(twin_run):\n    import calibration\n")
    options = {"cwd": tmp_path, "env": environment(installed), "capture_output": True, "text": True}
    done = subprocess.run([installed / "bin/python", "-m", "pytest", "-q"], **options)
    assert done.returncode == 0, done.stdout[-2000:]
