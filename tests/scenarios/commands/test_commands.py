"""The command line: what it runs and what it prints. The engines are replaced by small fakes."""

import json
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import pytest
from threadpoolctl import threadpool_limits
from typer.testing import CliRunner

from calibration.options import Options
from scenarios.commands import main
from scenarios.files.output_folder import RUN
from tests.scenarios.commands.stand_ins import Twin, blas_threads, here


def test_help_and_import_touch_no_engine():
    heavy = {"mujoco", "pinocchio", "numpy", "scipy", "matplotlib", "pydantic", "ruamel", "jinja2"}
    script = f"import sys, scenarios, scenarios.commands.main; print(*({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


@pytest.mark.parametrize(
    ("arguments", "shown"),
    [(("list",), "humanoids2024  "), (("check", ".", "--max", "model_2.mm=2"), "ok     model_2.mm")],
)
def test_lists_and_limits_need_no_engine(arguments, shown, tmp_path):
    row = {"model": "model_2", "base": "fixed", "encoder": "motor", "trials": "dynamic"}
    (tmp_path / "evaluation.json").write_text(json.dumps({"rows": [row | {"position_rmse_component_mm": 1.0}]}))
    code = f"import sys; from scenarios.commands import main; main.main({list(arguments)})"
    heavy = {"mujoco", "pinocchio", "scipy", "matplotlib", "netCDF4"}
    script = f"try:\n    {code}\nfinally:\n    print('loaded', *({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert shown in done.stdout and done.stdout.splitlines()[-1].split() == ["loaded"]


def test_the_installed_command_is_this_one():
    done = subprocess.run([Path(sys.executable).parent / "tiago-twin", "--help"], capture_output=True, text=True)
    assert done.returncode == 0
    for name in ("list", "run", "simulate", "calibrate", "evaluate", "report"):
        assert f"  {name} " in done.stdout


@pytest.mark.parametrize("option", ["-h", "--help"])
def test_every_command_has_help_with_an_example(tiago_twin, option):
    for command in main.app.registered_commands:
        name = str(command.name or command.callback.__name__)
        code, out, _ = tiago_twin(name, option)
        example = out.splitlines()[-1].strip()  # one line, to be copied
        assert (code, example) == (0, str(command.epilog).splitlines()[-1])
        assert example.startswith(f"Example: tiago-twin {name}")


def test_the_version_is_that_of_the_package(tiago_twin):
    assert tiago_twin("--version")[:2] == (0, f"tiago-twin {version('tiago-twin')}\n")


def test_list_names_the_scenarios_a_line_each(engines, tiago_twin):
    assert tiago_twin("list") == (0, "small  A small example\n", "")


def test_run_writes_the_folder_and_prints_verdict_and_report(engines, tiago_twin):
    code, out, err = tiago_twin("run", "small")
    assert code == 0, err
    written = {path.name for path in Path("runs/small").iterdir()}
    assert written == RUN.entries - {"evaluation.nc", "refused.txt"}
    assert out.splitlines() == ["Calibrated.", f"Report: {Path('runs/small/report.html')}"]


def test_only_the_dataset_reaches_the_calibration(engines, tiago_twin):
    tiago_twin("run", "small")
    dataset, stages = engines.calls["calibrate"]
    assert (dataset.name, stages) == ("dataset", None)


def test_engines_work_with_one_blas_thread_and_nobody_else_is_limited(engines, tiago_twin):
    with threadpool_limits(2, "blas"):
        tiago_twin("run", "small")
        assert set(engines.calls["blas"]) == {1}
        assert set(blas_threads()) == {2}


def test_progress_is_reported_on_stderr_without_a_terminal(engines, tiago_twin):
    code, out, err = tiago_twin("run", "small")
    assert [line.split()[0] for line in err.splitlines()] == ["simulate", "calibrate", "evaluate", "report"]
    assert "simulate" not in out


def test_seed_quick_and_set_change_the_scenario(engines, tiago_twin):
    tiago_twin("run", "small", "--seed", "8", "--quick", "--set", "twin.gap=1e-3", "--out", "x")
    assert engines.calls["record"] == (Twin(gap=1e-3), 8)
    assert "description: short" in Path("x/scenario.yaml").read_text()


def test_the_scenario_of_a_run_makes_the_same_run(engines, tiago_twin):
    assert tiago_twin("run", "small", "--seed", "8", "--set", "twin.gap=0.012345678901234567", "--out", "a")[0] == 0
    assert "numpy:" in Path("a/scenario.yaml").read_text()
    assert tiago_twin("run", "a/scenario.yaml", "--out", "b")[0] == 0
    files = here()
    assert {k: v for k, v in files.items() if k[0] == "b"} == {f"b{k[1:]}": v for k, v in files.items() if k[0] == "a"}


def test_simulate_writes_dataset_and_truth(engines, tiago_twin):
    assert tiago_twin("simulate", "small", "--out", "x")[0] == 0
    assert {path.name for path in Path("x").iterdir()} == {"scenario.yaml", "dataset", "truth", "figures"}


def test_the_calibration_gets_what_the_scenario_or_the_command_line_chose(engines, tiago_twin):
    tiago_twin("run", "small", "--out", "x")
    assert engines.calls["options"] == (Options(terms="tensor"),)
    tiago_twin("calibrate", "x/dataset", "--out", "x/estimate", "--terms", "printed", "--suspension", "full")
    assert engines.calls["options"] == (Options("printed", "full"),)
    tiago_twin("calibrate", "x/dataset", "--out", "x/estimate")
    assert engines.calls["options"] == (Options(),)


def test_calibrate_takes_stages_and_prints_verdicts(engines, tiago_twin):
    tiago_twin("simulate", "small", "--out", "x")
    code, out, _ = tiago_twin("calibrate", "x/dataset", "--out", "x/estimate", "--stages", "clocks, geometry")
    assert (code, engines.calls["calibrate"][1]) == (0, ["clocks", "geometry"])
    assert "clocks" in out and "0.1 ms" in out
    assert Path("x/estimate/estimate.json").is_file() and Path("x/dataset").is_dir()


def test_evaluate_adds_to_a_run_and_leaves_the_rest(engines, tiago_twin):
    tiago_twin("run", "small", "--out", "x")
    before = {path.name for path in Path("x").iterdir()}
    code, out, _ = tiago_twin("evaluate", "x/estimate", "x/dataset", "--out", "x")
    assert (code, "against mocap" in out) == (0, True)
    assert {path.name for path in Path("x").iterdir()} == before - {"score.json"}
    code, out, _ = tiago_twin("evaluate", "x/estimate", "x/dataset", "--truth", "x/truth", "--out", "x")
    assert (code, "against truth" in out) == (0, True)


def test_report_is_made_from_a_run_folder(engines, tiago_twin):
    tiago_twin("run", "small", "--out", "x")
    Path("x/report.html").unlink()
    assert tiago_twin("report", "x")[:2] == (0, "Report: x/report.html\n")


def test_help_lists_every_command_in_a_group_and_offers_completion(tiago_twin):
    text = tiago_twin("-h")[1]
    assert "Calibrate and evaluate:" in text and "--install-completion" in text
    assert "\nCommands:" not in text


def test_completion_knows_the_scenarios():
    asked = {"_TIAGO_TWIN_COMPLETE": "complete_bash", "COMP_WORDS": "tiago-twin run hum", "COMP_CWORD": "2"}
    assert CliRunner().invoke(main.app, [], env=asked, prog_name="tiago-twin").output.split() == ["humanoids2024"]


@pytest.mark.parametrize(
    ("terminal", "options", "n"), [(False, (), 0), (True, (), 1), (True, ("--no-open",), 0), (False, ("--open",), 1)]
)
def test_a_view_opens_on_a_screen_and_not_in_a_pipe(terminal, options, n, monkeypatch, tiago_twin, tmp_path):
    opened = []
    monkeypatch.setitem(sys.modules, "scenarios.view.page", SimpleNamespace(write=lambda *_: "xyz"))
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: terminal)
    monkeypatch.setenv("DISPLAY", ":0")
    assert tiago_twin("view", str(tmp_path), *options)[0] == 0
    assert opened == [(tmp_path / "view.html").as_uri()] * n


def test_show_prints_the_values_that_a_word_is_about_and_refuses_one_that_is_nowhere(tiago_twin):
    code, out, _ = tiago_twin("show", "short", "arm_6_joint.gap")
    assert (code, out.splitlines()[2:]) == (
        0,
        ["twin.arm.arm_6_joint.gap = 0.024 [rad]; 0 <= x <= 0.1; Total backlash"],
    )
    code, out, err = tiago_twin("show", "short", "nothing like it")
    assert (code, out) == (2, "") and "in no path and no meaning of short" in err
