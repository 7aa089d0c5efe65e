"""A run of the default scenario that several files of claims look at, made once for all workers."""

import fcntl
import pickle
from pathlib import Path

import pytest

from scenarios import load, run


@pytest.fixture(scope="session")
def quick_run(tmp_path_factory, worker_id):
    """The short variant of the default scenario, whole; the first worker that asks makes it, the others wait."""
    base: Path = tmp_path_factory.getbasetemp()
    shared = base if worker_id == "master" else base.parent
    with (shared / "quick_run.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        kept = shared / "quick_run.pickle"
        if not kept.is_file():
            kept.write_bytes(pickle.dumps(run(load("humanoids2024"), shared / "quick_run", quick=True)))
        return pickle.loads(kept.read_bytes())
