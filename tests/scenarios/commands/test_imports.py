"""A command imports what it uses: help at once, libraries by the time a mistake in its input is found."""

import resource
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
LIBRARIES = {"mujoco", "pinocchio", "numba", "matplotlib", "viser", "trimesh", "distributed", "ezc3d", "rosbags"}
HELP = 0.3  # [s] of processor time
MISTAKE = "--set x=1"
USED = {  # a line with a mistake, and the libraries that the command uses
    "list": "",
    "check nowhere --max a.mm=1": "",
    "run nowhere": "",
    f"run short {MISTAKE}": "mujoco",
    f"simulate short {MISTAKE} --out o": "mujoco",
    "show nowhere": "",
    "show short": "mujoco",
    f"dataset short {MISTAKE} -n 1 --out o": "mujoco",
    f"study coverage short {MISTAKE} -n 2 --out o": "mujoco",
    f"design short {MISTAKE} -n 6 --out o": "mujoco",
    f"reality {MISTAKE} -n 5 --out o": "mujoco pinocchio",
    "picture nowhere --still o.png": "mujoco",
    "calibrate nowhere --out o": "pinocchio",
    "evaluate nowhere nowhere --out o": "pinocchio",
    "report nowhere": "pinocchio matplotlib",
    "look nowhere --out o": "pinocchio matplotlib",
    "view nowhere": "pinocchio viser trimesh",
    "import csv a.csv --map nowhere --out o": "pinocchio",
    "export urdf nowhere --out o": "pinocchio",
    "process nowhere --out o": "pinocchio",
    "base a.csv --map nowhere --out o": "pinocchio",
    "predict nowhere --map nowhere --out o": "pinocchio",
    "benchmark score nowhere --in nowhere --out o": "mujoco pinocchio",
    "peer nowhere --out o": "mujoco pinocchio",
}


def loaded(line, folder):
    """Libraries that a command has imported when it ends, and its processor time [s]."""
    script = (
        f"import sys\nfrom scenarios.commands import main\ntry:\n    main.main({line.split()})\n"
        f"finally:\n    print('loaded', *({LIBRARIES} & set(sys.modules)))"
    )
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=folder)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert "Traceback" not in done.stderr, done.stderr
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return set(done.stdout.splitlines()[-1].split()[1:]), used


def test_every_command_is_here():
    from scenarios.commands import main

    assert {line.split()[0] for line in USED} == {c.name or c.callback.__name__ for c in main.app.registered_commands}


def test_kernels_import_numba_when_they_are_called():
    found = {
        p.relative_to(ROOT).as_posix()
        for p in (ROOT / "calibration").rglob("*.py")
        if "from numba import" in p.read_text()
    }
    assert found == {"calibration/numerics/compiled.py"}


@pytest.mark.slow
@pytest.mark.parametrize("line", USED)
def test_a_command_imports_what_it_uses(line, tmp_path):
    assert loaded(line, tmp_path)[0] <= set(USED[line].split())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["", *sorted({line.split()[0] for line in USED})])
def test_help_takes_less_than_three_tenths_of_a_second(name, tmp_path):
    libraries, least = loaded(f"{name} --help", tmp_path)
    for _ in range(2):
        least = min(least, loaded(f"{name} --help", tmp_path)[1])
    assert (libraries, least < HELP) == (set(), True), least
