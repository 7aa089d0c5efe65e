"""Every command and every Python block of a document runs, in its order, in an empty folder."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = tuple(f"docs/{p}.md" for p in "tutorials python geometry frames commands scale reality".split())
ELSEWHERE = {
    "README.md": "tests/project/test_wheel.py",
    "docs/recording.md": "tests/acceptance/own_robot/test_recording_page.py",
    "docs/benchmark.md": "tests/scenarios/benchmarks/test_benchmark_page.py",
    "examples/validate_my_calibration/README.md": "tests/scenarios/testing/test_pytest_plugin.py",
    "CONTRIBUTING.md": "tests/project/test_recipes_twin.py",
}
FEWER = {  # the same commands on less data
    r"-n (1000|200|50)\b": "-n 2",
    r"=14,20,30\b": "=14,20",
    r"(tiago-twin reality)\b": r"\1 -n 5",
    r"(tiago-twin run humanoids2024)\b": r"\1 --quick",
}
DRIVER = """
import json, subprocess, sys
from pathlib import Path
known = {"__name__": "__main__"}
for language, block in json.load(sys.stdin):
    print(block, file=sys.stderr, flush=True)
    if language == "bash":
        subprocess.run(["bash", "-euo", "pipefail", "-c", block], check=True)
    elif "def test_" in block:
        Path("test_block.py").write_text(block)
        subprocess.run([sys.executable, "-m", "pytest", "-q", "test_block.py"], check=True)
    else:
        exec(compile(block, "block", "exec"), known)
"""


@pytest.fixture
def folder(tmp_path):
    """An empty folder with the repository's data and documents, and the command where `make` puts it."""
    for name in ("tests", "docs", "examples"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / ".venv").mkdir()
    (tmp_path / ".venv" / "bin").symlink_to(Path(sys.executable).parent)
    log, table = (
        ROOT / "tests/data" / f"{n}.csv" for n in ("vicon_forceplate_2023-09-20", "qualisys_2021-11-30_postures")
    )
    (tmp_path / log.name).symlink_to(log)
    (tmp_path / "postures.csv").symlink_to(table)
    head, *rows = table.read_text(encoding="utf-8").splitlines()
    for name, part in (("day1", [r for k, r in enumerate(rows) if k % 4]), ("day2", rows[::4])):
        (tmp_path / f"{name}.csv").write_text("\n".join([head, *part]) + "\n", encoding="utf-8")
    return tmp_path


def blocks(page):
    """Blocks of a page, each with its language; targets of make have tests of their own, dask's programs too."""
    for language, block in re.findall(r"```(bash|python)\n(.*?)```", (ROOT / page).read_text(), re.DOTALL):
        if language == "bash":
            block = re.sub(r"^(make|dask) .*\n", "", block, flags=re.MULTILINE)
            for pattern, fewer in FEWER.items():
                block = re.sub(pattern, fewer, block)
        if block.strip():
            yield language, block


def test_every_page_with_code_is_run_by_a_test():
    found = (
        p.relative_to(ROOT).as_posix()
        for pattern in ("*.md", "docs/**/*.md", "examples/**/*.md", "mjcf/*.md")
        for p in ROOT.glob(pattern)
        if ROOT / "docs/reference" not in p.parents  # made by `make docs`
    )
    assert {page for page in found if list(blocks(page))} == {*PAGES, *ELSEWHERE}
    assert all((ROOT / test).exists() for test in ELSEWHERE.values())


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_every_line_of_a_page_runs(page, folder):
    bin_ = Path(sys.executable).parent
    environment = os.environ | {"PATH": f"{bin_}{os.pathsep}{os.environ['PATH']}", "MPLBACKEND": "Agg"}
    options = {"cwd": folder, "env": environment, "capture_output": True, "text": True, "timeout": 1800}
    done = subprocess.run([sys.executable, "-c", DRIVER], input=json.dumps(list(blocks(page))), **options)
    assert done.returncode == 0, f"{done.stdout[-500:]}\n{done.stderr[-3000:]}"


@pytest.mark.slow
def test_a_scenarios_robot_opens_in_the_viewer_of_mujoco(monkeypatch):
    viewer = pytest.importorskip("mujoco.viewer", exc_type=ImportError)
    opened = []
    monkeypatch.setattr(viewer, "launch", opened.append)
    (line,) = re.findall(r'`python -c "(import mujoco.viewer, .*)"`', (ROOT / "docs/commands.md").read_text())
    exec(line, {})
    assert opened[0].nbody > 20
