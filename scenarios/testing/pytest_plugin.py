"""Fixtures for test suites of calibration code; the engines are loaded when the first run is asked for.

def test_my_calibration(twin_run, assert_improves, assert_covers):
    run = twin_run("short", seed=3)               # simulated, calibrated, judged: a RunResult
    mine = calibrated(run.folder / "dataset")     # yours: an estimate.json, or a URDF
    evaluation, score = scenarios.steps.evaluate(mine, run.folder / "dataset", "out", run.folder / "truth")
    assert_improves(evaluation, "full", over="registration", by=0.5)
    assert_covers(score, at_least=0.9)
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from scenarios.steps import RunResult


@pytest.fixture(scope="session")
def twin_run(tmp_path_factory: pytest.TempPathFactory) -> "Callable[..., RunResult]":
    """A run of a scenario, `twin_run(scenario="short", seed=None, settings=(), quick=True)`, made once a session.

    `scenario` is a name from `tiago-twin list` or a path, `settings` are "path=value" as `--set` takes them.
    """
    known: dict[tuple[str, tuple[str, ...], bool], RunResult] = {}

    def run(
        scenario: str = "short", seed: int | None = None, settings: Sequence[str] = (), quick: bool = True
    ) -> "RunResult":
        from scenarios import steps

        changed = (*settings, *([] if seed is None else [f"seed={seed}"]))
        key = (str(scenario), changed, quick)
        if key not in known:
            folder = tmp_path_factory.mktemp("twin_run") / "run"
            known[key] = steps.run(steps.load(scenario, changed), folder, quick=quick)
        return known[key]

    return run


@pytest.fixture(scope="session")
def assert_improves() -> Callable[..., None]:
    """`scenarios.testing.assert_improves`."""
    from scenarios.testing import assertions

    return assertions.assert_improves


@pytest.fixture(scope="session")
def assert_covers() -> Callable[..., None]:
    """`scenarios.testing.assert_covers`."""
    from scenarios.testing import assertions

    return assertions.assert_covers
