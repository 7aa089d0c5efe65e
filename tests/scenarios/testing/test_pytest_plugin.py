"""Fixtures for other people's suites: assertions on plain results, and an example project with the built wheel."""

import os
import resource
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from scipy.stats import binom

from scenarios.testing import pytest_plugin
from scenarios.testing.pytest_plugin import TwinResult

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "examples" / "validate_my_calibration"

FAILS = """
from pathlib import Path
from tiago_twin_pytest import TwinResult

def test_fails(assert_within):
    names = {"model": "mine", "trials": "dynamic", "base": "fixed", "encoder": "motor"}
    result = TwinResult(Path(), "mine", (names | {"position_rmse_norm_mm": 8.0},), {})
    assert_within(result, mm=5.0)
"""


def row(model, base, mm, deg=1.0):
    names = {"model": model, "trials": "dynamic", "base": base, "encoder": "motor"}
    return names | {"position_rmse_norm_mm": mm, "orientation_rmse_deg": deg}


def result(inside=0, n=0):
    rows = (row("nominal", "fixed", 20.0), row("mine", "fixed", 8.0), row("mine", "dynamics", 5.0))
    entries = [{"name": f"p{k}", "z": 3.0 if k >= inside else 0.5} for k in range(n)]
    score = {"n_covered": inside, "n_judged": n, "parameters": entries, "combinations": []}
    return TwinResult(Path("folder"), "mine", rows, score)


def test_a_row_is_the_main_one_with_the_best_base_that_is_not_measured():
    assert result().row()["position_rmse_norm_mm"] == 5.0
    assert result().row(base="fixed")["position_rmse_norm_mm"] == 8.0
    with pytest.raises(KeyError, match="no row yours .dynamic, base any, motor.; there are mine .dynamic, base"):
        result().row("yours")


def test_gains_are_relative_to_another_row(assert_improves):
    assert_improves(result(), by=0.7)
    with pytest.raises(pytest.fail.Exception, match=r"base dynamics.*: 5.00 mm, nominal: 20.00 mm; 75% better, at le"):
        assert_improves(result(), by=0.8)


def test_limits_are_named_with_what_was_found(assert_within):
    assert_within(result(), mm=5.0, deg=1.0)
    with pytest.raises(pytest.fail.Exception, match="position_rmse_norm_mm is 5.00 mm, at most 4.9 mm allowed"):
        assert_within(result(), mm=4.9)
    with pytest.raises(pytest.fail.Exception, match="orientation_rmse_deg is 1.00 deg, at most 0.5 deg allowed"):
        assert_within(result(), deg=0.5)


@pytest.mark.parametrize("inside, n, at_least", [(95, 100, None), (88, 100, None), (60, 100, 0.6), (3, 3, None)])
def test_intervals_that_may_be_valid_pass(assert_covers, inside, n, at_least):
    assert_covers(result(inside, n), at_least)


@pytest.mark.parametrize("inside, n, at_least", [(85, 100, None), (94, 100, 0.95), (0, 3, None), (0, 0, None)])
def test_intervals_that_are_too_narrow_fail_by_name(assert_covers, inside, n, at_least):
    with pytest.raises(pytest.fail.Exception, match=f"outside: p{inside}" if n else "0 of 0"):
        assert_covers(result(inside, n), at_least)


@pytest.mark.parametrize("n", [1, 3, 40, 700])
def test_the_quantile_is_the_binomial_one(n):
    assert pytest_plugin._quantile(n) == binom.ppf(0.001, n, 0.95)


def test_results_are_cached_by_content_and_old_ones_removed(tmp_path, monkeypatch):
    monkeypatch.setenv("TIAGO_TWIN_CACHE", str(tmp_path))
    monkeypatch.setattr(pytest_plugin, "_MAIN", "import pathlib, sys; pathlib.Path(sys.argv[-1]).mkdir()  # {home}")
    first = pytest_plugin._cached("run", ["short", "1"], ("run", "short"))
    assert pytest_plugin._cached("run", ["short", "1"], ("run", "short")) == first
    assert pytest_plugin._cached("run", ["short", "2"], ("run", "short")) != first
    os.utime(first, (0.0, 0.0))
    pytest_plugin._cached("run", ["short", "2"], ("run", "short"))
    assert not first.exists()


def test_a_command_that_fails_is_reported_with_its_message(tmp_path, monkeypatch, twin_run):
    monkeypatch.setenv("TIAGO_TWIN_CACHE", str(tmp_path))
    with pytest.raises(pytest.fail.Exception, match="tiago-twin run shrt --quick: exit 2\nshrt: no such scenario"):
        twin_run("shrt")
    assert list((tmp_path / "pytest").iterdir()) == []


def test_the_plugin_imports_the_standard_library_and_pytest_only():
    code = (
        "import sys, pytest; before = set(sys.modules); import importlib.util as u\n"
        f"s = u.spec_from_file_location('tiago_twin_pytest', {pytest_plugin.__file__!r}); m = u.module_from_spec(s)\n"
        "sys.modules[s.name] = m; s.loader.exec_module(m)\n"
        "new = {n.partition('.')[0] for n in set(sys.modules) - before} - set(sys.stdlib_module_names)\n"
        "sys.exit(str(new - {'tiago_twin_pytest'}) if new - {'tiago_twin_pytest'} else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_a_project_with_a_package_of_our_name_passes_with_the_wheel_and_an_empty_home(tmp_path):
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    zipfile.ZipFile(next(tmp_path.glob("*.whl"))).extractall(tmp_path / "installed")
    project = shutil.copytree(EXAMPLE, tmp_path / "project", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "home").mkdir()
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("PYTEST", "XDG", "TIAGO"))}
    environment = kept | {"HOME": str(tmp_path / "home"), "PYTHONPATH": str(tmp_path / "installed")}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", str(project)]
    took = []
    for _ in range(2):
        before = cpu_seconds()
        done = subprocess.run(command, cwd=project, env=environment, capture_output=True, text=True)
        took.append(cpu_seconds() - before)
        assert (done.returncode, "4 passed" in done.stdout) == (0, True), done.stdout[-3000:] + done.stderr[-2000:]
    (project / "test_fails.py").write_text(FAILS)
    only = ["test_fails.py", "--junitxml", str(tmp_path / "junit.xml")]
    assert subprocess.run([*command, *only], cwd=project, env=environment, capture_output=True).returncode == 1
    assert (
        'message="Failed: mine (dynamic trials, base fixed, motor encoders): ' in (tmp_path / "junit.xml").read_text()
    )
    print(f"first session {took[0]:.1f} s, with the cache {took[1]:.1f} s of one core")
    assert took[0] <= 60.0 and took[1] <= 5.0


def cpu_seconds():
    """Of ended child processes: what a free machine would take, however busy this one is."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
