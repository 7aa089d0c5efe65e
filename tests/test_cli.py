"""The command line: what it runs, what it tells, its exit codes, and that nothing half-written stays.

The engines are replaced by small fakes, but for the tests of broken data at the end.
"""

import json
import os
import signal
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Annotated

import pytest
from pydantic import BaseModel, ConfigDict, Field
from threadpoolctl import threadpool_info, threadpool_limits

import calibration
import scenarios
import twin.picture
from calibration.errors import CalibrationError, InputError
from calibration.options import Options
from scenarios import cli, registry
from scenarios.errors import ScenarioError
from scenarios.folder import RUN
from twin.errors import TwinError

ROW = {
    "model": "registration",
    "trials": "dynamic",
    "base": "fixed",
    "encoder": "motor",
    "position_rmse_component_mm": 4.5678,
    "position_rmse_norm_mm": 7.9,
    "orientation_rmse_deg": 1.25,
}

YAML = "name: small\ndescription: A small example\nseed: 3\ntwin:\n  gap: 0.01\n"


class Twin(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    gap: Annotated[float, Field(ge=0, le=0.05)]


class Scenario(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    name: str
    description: str
    seed: Annotated[int, Field(ge=0)]
    twin: Twin
    calibration: Options = Options(terms="tensor")

    def quick(self) -> "Scenario":
        return self.model_copy(update={"description": "short"})


def blas_threads() -> tuple[int, ...]:
    """Threads of each loaded library of linear algebra."""
    return tuple(library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas")


@dataclass
class Engines:
    """Stand-ins; `fail` raises in a step, `calls` keeps what they were given."""

    fail: dict[str, BaseException] = field(default_factory=dict)
    calls: dict[str, tuple] = field(default_factory=dict)
    calibrated: bool = True

    def step(self, name: str, *arguments: object) -> None:
        self.calls[name] = arguments
        if name in self.fail:
            raise self.fail[name]

    def record(self, config, seed, out, progress):
        (out / "dataset").mkdir()
        (out / "dataset" / "dataset.json").write_text(f"{config.gap} {seed}")
        (out / "truth").mkdir()
        progress("trial around_x", 0.5)
        self.step("record", config, seed)

    def load(self, dataset):
        return Path(dataset)

    def calibrate(self, dataset, stages=None, progress=None, options=None):
        self.step("calibrate", dataset, stages)
        self.calls["options"] = (options,)
        self.calls["blas"] = blas_threads()
        return self.load_estimate(dataset)

    def load_estimate(self, path):
        verdict = SimpleNamespace(stage="clocks", verdict="ok", message="0.1 ms")
        return SimpleNamespace(calibrated=self.calibrated, verdicts=[verdict])

    def save_estimate(self, estimate, folder):
        self.saves("estimate.json", {"main": "model_2"})(folder)

    def evaluate(self, estimate, dataset, progress=None):
        self.step("evaluate", dataset)
        return SimpleNamespace(save=self.saves("evaluation.json", {"rows": [{**ROW, "against": "mocap"}]}))

    def score(self, estimate, dataset, truth_dir, evaluation):
        self.step("score", truth_dir)
        row = {**ROW, "model": "floor", "against": "truth"}
        return SimpleNamespace(save=self.saves("score.json", {"rows": [row]}))

    def report(self, run_dir):
        self.step("report", run_dir)
        (Path(run_dir) / "report.html").write_text("<html>")

    @staticmethod
    def saves(name, content=None):
        def save(folder):
            folder.mkdir(exist_ok=True)
            (folder / name).write_text(json.dumps(content))

        return save


@pytest.fixture
def engines(monkeypatch, tmp_path):
    """Replace every engine, offer one scenario `small`, and work in an empty folder."""
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    fakes = Engines()
    for package, name in (
        (twin, "record"),
        *((calibration, name) for name in ("load", "calibrate", "save_estimate", "load_estimate", "evaluate")),
    ):
        monkeypatch.setattr(package, name, getattr(fakes, name), raising=False)
    for name, content in (
        ("schema", {"Scenario": Scenario}),
        ("score", {"score": fakes.score}),
        ("report", {"write": fakes.report}),
    ):
        module = ModuleType(f"scenarios.{name}")
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, module.__name__, module)
        monkeypatch.setattr(scenarios, name, module, raising=False)
    monkeypatch.setattr(twin.picture, "picture", lambda config, seed, path: path.write_text("picture"))
    (tmp_path / "known").mkdir()
    (tmp_path / "known" / "small.yaml").write_text(YAML)
    monkeypatch.setattr(registry, "HERE", tmp_path / "known")
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    return fakes


@pytest.fixture
def tiago_twin(capsys):
    """Run the command in this process; return exit code, stdout and stderr."""

    def command(*arguments: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as info:
            cli.main(arguments)
        return int(info.value.code or 0), *capsys.readouterr()

    return command


def here() -> dict[str, str]:
    """Every file below the current folder with its text."""
    return {str(path): path.read_text() for path in sorted(Path().rglob("*")) if path.is_file()}


def test_help_and_import_touch_no_engine():
    heavy = {"mujoco", "pinocchio", "numpy", "scipy", "matplotlib", "pydantic", "ruamel", "jinja2"}
    script = f"import sys, scenarios, scenarios.cli; print(*({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_the_installed_command_is_this_one():
    done = subprocess.run([Path(sys.executable).parent / "tiago-twin", "--help"], capture_output=True, text=True)
    assert done.returncode == 0
    for name in ("list", "run", "simulate", "calibrate", "evaluate", "report"):
        assert f"  {name} " in done.stdout


def test_list_names_the_scenarios_a_line_each(engines, tiago_twin):
    assert tiago_twin("list") == (0, "small  A small example\n", "")


def test_run_writes_the_folder_and_prints_ladder_and_report(engines, tiago_twin):
    code, out, err = tiago_twin("run", "small")
    assert code == 0, err
    written = {path.name for path in Path("runs/small").iterdir()}
    assert written == RUN.entries - {"evaluation.nc"}
    assert "floor" in out and "4.57" in out and "against truth" in out
    assert f"Report: {Path('runs/small/report.html')}" in out


def test_only_the_dataset_reaches_the_calibration(engines, tiago_twin):
    tiago_twin("run", "small")
    dataset, stages = engines.calls["calibrate"]
    assert (dataset.name, stages) == ("dataset", None)


def test_engines_work_with_one_blas_thread_and_nobody_else_is_limited(engines, tiago_twin):
    with threadpool_limits(2, "blas"):
        tiago_twin("run", "small")
        assert set(engines.calls["blas"]) == {1}
        assert set(blas_threads()) == {2}


def test_progress_is_told_on_stderr_without_a_terminal(engines, tiago_twin):
    code, out, err = tiago_twin("run", "small")
    assert [line.split()[0] for line in err.splitlines()] == ["simulate", "calibrate", "evaluate", "score", "report"]
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


def test_the_calibration_is_told_what_the_scenario_or_the_command_line_chose(engines, tiago_twin):
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


def test_an_estimate_that_must_not_be_used_is_kept_and_ends_with_1(engines, tiago_twin):
    tiago_twin("simulate", "small", "--out", "x")
    engines.calibrated = False
    code, out, err = tiago_twin("calibrate", "x/dataset", "--out", "x/estimate")
    assert code == 1 and "must not be used" in err and "clocks" in out
    assert Path("x/estimate/estimate.json").is_file()


@pytest.mark.parametrize(
    ("step", "error", "expected"),
    [
        ("record", TwinError("diverged at 3 s"), 1),
        ("calibrate", CalibrationError("rank 3 of 9"), 1),
        ("calibrate", InputError("a/b.nc", "truncated"), 2),
        ("score", ScenarioError("no truth.json"), 2),
        ("report", OSError(28, "No space left on device"), 1),
    ],
)
def test_an_error_is_one_message_and_leaves_the_old_run(engines, tiago_twin, step, error, expected):
    tiago_twin("run", "small", "--out", "x")
    before = here()
    engines.fail[step] = error
    code, out, err = tiago_twin("run", "small", "--out", "x", "--seed", "9")
    assert (code, out, err.splitlines()[-1]) == (expected, "", str(error))
    assert here() == before
    assert tiago_twin("run", "small", "--out", "new")[0] == expected
    assert here() == before


def test_a_mistake_of_ours_is_not_hidden(engines, tiago_twin):
    engines.fail["evaluate"] = ValueError("a bug")
    with pytest.raises(ValueError, match="a bug"):
        cli.main(["run", "small", "--out", "x"])
    assert here() == {}


@pytest.mark.parametrize(("number", "expected"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_signal_leaves_nothing(engines, tiago_twin, number, expected):
    engines.step = lambda name, *_: os.kill(os.getpid(), number)
    assert tiago_twin("run", "small", "--out", "x")[0] == expected
    assert here() == {} and not list(Path().iterdir())


BAD_FILES = [
    (YAML.replace("gap", "gape"), ["f.yaml:5:3: twin.gape: unknown field; did you mean gap?", "twin.gap: missing"]),
    (YAML + "seed: 4\n", ["f.yaml:6:1: not YAML", "duplicate key"]),
    (YAML.replace("0.01", "0.5"), ["f.yaml:5:8: twin.gap: ", "less than or equal to 0.05 (got 0.5)"]),
    (YAML.replace("3", "'3'").replace("0.01", "wide"), ["f.yaml:3:7: seed: ", "f.yaml:5:8: twin.gap: "]),
    ("name: [small\n", ["f.yaml:2:1: not YAML"]),
    ("", ["f.yaml:1:1: the file is empty"]),
]


@pytest.mark.parametrize(("text", "words"), BAD_FILES)
@pytest.mark.parametrize("command", ["run", "simulate"])
def test_a_bad_scenario_file_ends_with_2_and_every_place(engines, tiago_twin, command, text, words):
    Path("f.yaml").write_text(text)
    code, out, err = tiago_twin(command, "f.yaml", "--out", "x")
    assert (code, out) == (2, "")
    for word in words:
        assert word in err
    assert list(here()) == ["f.yaml"] and not engines.calls


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "smal"], ["no such scenario", "did you mean small?", "tiago-twin list"]),
        (["run", "none.yaml"], ["none.yaml: no such scenario and no such file"]),
        (["run", "small", "--set", "twin.gap=1"], ["--set twin.gap: ", "(got 1)"]),
        (["run", "small", "--set", "twin.gpa=0"], ["--set twin.gpa: unknown field; did you mean gap?"]),
        (["run", "small", "--set", "twin.gap"], ["--set twin.gap: write path.to.field=value"]),
        (["run", "small", "--seed", "-1"], ["--seed"]),
        (["run", "small", "--seed", "one"], ["--seed"]),
        (["run", "small", "--sede", "1"], ["No such option"]),
        (["simulate", "small"], ["--out"]),
        (["calibrate", "d", "--out", "x", "--stages", "clocks,geometri"], ["no stage 'geometri'", "clocks, regis"]),
        (["calibrate", "d", "--out", "x", "--stages", ""], ["no stage ''"]),
        (
            ["calibrate", "d", "--out", "x", "--terms", "cubic"],
            ["--terms", "'printed', 'tensor' or 'total'", "'cubic'"],
        ),
        (["launch"], ["No such command"]),
    ],
)
def test_wrong_arguments_end_with_2_and_a_remedy(engines, tiago_twin, arguments, words):
    code, out, err = tiago_twin(*arguments)
    assert (code, out) == (2, "")
    for word in words:
        assert word in err
    assert here() == {}


def test_a_folder_that_is_not_ours_is_refused_before_any_work(engines, tiago_twin):
    Path("thesis").mkdir()
    Path("thesis/chapter.tex").write_text("mine")
    code, _, err = tiago_twin("run", "small", "--out", "thesis")
    assert code == 2 and "chapter.tex" in err and not engines.calls
    assert here() == {"thesis/chapter.tex": "mine"}


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({}, "no such folder"),
        ({"data/notes.txt": ""}, "dataset.json: no such file"),
        ({"data/dataset.json": '{"schema": 1,'}, "dataset.json:1:14: broken JSON"),
        ({"data/dataset.json": "{}"}, "trials: Field required"),
    ],
)
def test_broken_data_end_with_2_and_leave_nothing(tmp_path, monkeypatch, tiago_twin, files, words):
    monkeypatch.chdir(tmp_path)
    for name, text in files.items():
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).write_text(text)
    commands = (["calibrate", "data", "--out", "x"], ["evaluate", "data", "data", "--out", "x"], ["report", "data"])
    for command in commands:
        code, out, err = tiago_twin(*command)
        assert (code, out) == (2, "") and here() == files
    code, _, err = tiago_twin("calibrate", "data", "--out", "x")
    assert words in err


@pytest.mark.parametrize(
    "command", [["list"], ["simulate", "short", "--out", "x"], ["calibrate", "nowhere", "--out", "x"]]
)
def test_an_engine_that_cannot_be_imported_is_told_in_a_line(tmp_path, command):
    code = f"from scenarios.cli import main; main({command})"
    surroundings = {**os.environ, "MUJOCO_GL": "bogus", "PYTHONPATH": str(Path(__file__).parent.parent)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=surroundings, capture_output=True, text=True, check=False
    )
    told = [line for line in done.stderr.splitlines() if line != "calibrate"]
    assert len(told) == 1 and not list(tmp_path.iterdir())
    if command[0] == "calibrate":  # needs no engine, and tells what is wrong
        assert done.returncode == 2 and told[0].startswith("nowhere: no such folder")
    else:
        assert done.returncode == 1 and "MUJOCO_GL='bogus'; unset it" in told[0]
