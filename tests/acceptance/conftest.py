"""Runs of the default scenario that several files of claims look at, made once by each worker."""

import pytest

from scenarios import load, run


@pytest.fixture(scope="session")
def quick_run(tmp_path_factory):
    """The short variant of the default scenario, whole."""
    return run(load("humanoids2024"), tmp_path_factory.mktemp("run") / "quick", quick=True)
