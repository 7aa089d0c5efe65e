"""Fixtures for other people's suites; the plugin is the installed one."""

import subprocess
import sys
from types import SimpleNamespace

import pytest

from calibration.errors import NotEnoughData


def test_a_run_is_made_once_and_its_calibration_improves(twin_run, assert_improves):
    run = twin_run("short", seed=3)
    assert twin_run("short", seed=3) is run and (run.folder / "truth/truth.json").is_file()
    assert_improves(run, by=0.5)
    assert_improves(run.evaluation, "model_2", over="registration", base="measured")
    with pytest.raises(AssertionError, match="nominal .dynamic, base fixed, motor encoders.: .* at least 1% asked"):
        assert_improves(run, "nominal", by=0.01)
    with pytest.raises(NotEnoughData, match="no row"):
        assert_improves(run, "model_9")


def judged(inside, n):
    outside = [SimpleNamespace(name=f"p{k}", z=3.0 if k >= inside else 0.5) for k in range(n)]
    return SimpleNamespace(n_covered=inside, n_judged=n, parameters=outside)


@pytest.mark.parametrize("inside, n, at_least", [(95, 100, None), (88, 100, None), (60, 100, 0.6), (3, 3, None)])
def test_intervals_that_may_be_right_pass(assert_covers, inside, n, at_least):
    assert_covers(judged(inside, n), at_least)


@pytest.mark.parametrize("inside, n, at_least", [(85, 100, None), (94, 100, 0.95), (0, 3, None), (0, 0, None)])
def test_intervals_that_are_too_narrow_fail_by_name(assert_covers, inside, n, at_least):
    with pytest.raises(AssertionError, match=f"outside: p{inside}" if n else "0 of 0"):
        assert_covers(judged(inside, n), at_least)


def test_the_plugin_loads_no_engine():
    heavy = "{'numpy', 'scipy', 'mujoco', 'pinocchio', 'matplotlib'}"
    code = f"import scenarios.testing.pytest_plugin, sys; sys.exit(sorted({heavy} & set(sys.modules)) or 0)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
