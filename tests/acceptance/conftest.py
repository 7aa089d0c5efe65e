"""Runs of the default scenario that several files of claims look at, made once by each worker."""

import pytest

from scenarios import load, run
from tests.acceptance.claims import keep


@pytest.fixture(scope="session")
def quick_run(tmp_path_factory):
    """The short variant of the default scenario, whole."""
    return run(load("humanoids2024"), tmp_path_factory.mktemp("run") / "quick", quick=True)


@pytest.fixture
def claim():
    """Keep the figures of a claim, one a robot, in runs/claims.json; `make claims` brings them into the documents."""
    return keep
