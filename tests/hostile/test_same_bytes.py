"""A run has the same bytes whatever the machine's threads, locale, time zone and folder are.

Counts of workers are in `tests/scenarios/datasets/test_collection.py`.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
RUN = "from scenarios.commands.main import main; main(['run', 'short', '--quick', '--seed', '5', '--out', 'run'])"
HERE = {"threads": "1", "TZ": "UTC", "LC_ALL": "C", "PYTHONHASHSEED": "1"}
THERE = {"threads": "2", "TZ": "Asia/Kolkata", "LC_ALL": "tr_TR.UTF-8", "PYTHONHASHSEED": "2"}


def _run(folder: Path, threads: str, **environment: str) -> dict[str, bytes]:
    """Files of a run, made in this folder."""
    folder.mkdir(parents=True)
    libraries = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), threads)
    env = {**os.environ, "PYTHONPATH": str(ROOT), **libraries, **environment}
    subprocess.run([sys.executable, "-c", RUN], cwd=folder, env=env, check=True, capture_output=True, timeout=600)
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_a_run_has_the_same_bytes_on_another_machine(tmp_path):
    here, there = _run(tmp_path / "a", **HERE), _run(tmp_path / "another folder/deeper", **THERE)
    assert here.keys() == there.keys() and len(here) > 10
    assert [name for name in here if here[name] != there[name]] == []
