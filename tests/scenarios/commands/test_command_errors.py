"""The command line: its exit codes, and that nothing half-written stays. Engines are fakes, but for broken data."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from calibration.errors import CalibrationError, InputError, NotCalibrated, NotEnoughData, NumericalFailure
from scenarios.commands import main
from scenarios.files.errors import ScenarioError
from tests.scenarios.commands.stand_ins import YAML, here
from twin.errors import TwinError


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
        ("report", MemoryError("12 GB"), 1),
    ],
)
def test_an_error_is_one_message_and_leaves_the_old_run(engines, tiago_twin, step, error, expected):
    tiago_twin("run", "small", "--out", "x")
    before = here()
    engines.fail[step] = error
    code, out, err = tiago_twin("run", "small", "--out", "x", "--seed", "9")
    assert (code, out) == (expected, "") and str(error) in err.splitlines()[-1] and "Traceback" not in err
    assert here() == before
    assert tiago_twin("run", "small", "--out", "new")[0] == expected
    assert here() == before


BROKEN = NumericalFailure("geometry", "zeros", "singular")


@pytest.mark.parametrize("error", [NotEnoughData("6 postures; record 7 more"), NotCalibrated(["rank 3 of 9"]), BROKEN])
def test_a_refused_run_keeps_its_recordings_and_a_report_of_why(engines, tiago_twin, error):
    engines.fail["calibrate"] = error
    code, out, err = tiago_twin("run", "small", "--out", "x")
    last = ["The recordings are kept, with a report of why: x/report.html"]
    assert (code, out, err.splitlines()[-2:]) == (1, "", [str(error), *last])
    assert Path("x/refused.txt").read_text() == f"{error}\n"
    assert {path.name for path in Path("x").iterdir()} >= {"dataset", "truth", "report.html", "scenario.yaml"}
    assert tiago_twin("report", "x")[0] == 0, "from what is saved"
    engines.fail.clear()
    assert tiago_twin("run", "small", "--out", "x")[0] == 0
    assert not Path("x/refused.txt").exists()


def test_a_mistake_of_ours_is_not_hidden(engines, tiago_twin):
    engines.fail["evaluate"] = ValueError("a bug")
    with pytest.raises(ValueError, match="a bug") as info:
        main.main(["run", "small", "--out", "x"])
    assert here() == {} and "mistake of tiago-twin" in info.value.__notes__[0]


@pytest.mark.parametrize(("number", "expected"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_signal_leaves_nothing(engines, tiago_twin, number, expected):
    engines.step = lambda name, *_: os.kill(os.getpid(), number)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
    try:
        assert tiago_twin("run", "small", "--out", "x")[0] == expected
    finally:
        signal.signal(signal.SIGINT, before)
    assert here() == {} and not list(Path().iterdir())


BAD_FILES = [
    (YAML.replace("gap", "gape"), ["f.yaml:5:3: twin.gape: unknown field; did you mean gap?", "twin.gap: missing"]),
    (YAML + "seed: 4\n", ["f.yaml:6:1: not YAML", "duplicate key"]),
    (YAML.replace("0.01", "0.5"), ["f.yaml:5:8: twin.gap: ", "at most 0.05 (got 0.5)"]),
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


@pytest.mark.parametrize("command", [["simulate", "short", "--out", "x"], ["calibrate", "nowhere", "--out", "x"]])
def test_an_engine_that_cannot_be_imported_is_reported_in_a_line(tmp_path, command):
    code = f"from scenarios.commands.main import main; main({command})"
    surroundings = {**os.environ, "MUJOCO_GL": "bogus", "PYTHONPATH": str(Path(__file__).parents[3])}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=surroundings, capture_output=True, text=True, check=False
    )
    reported = [line for line in done.stderr.splitlines() if line != "calibrate"]
    assert len(reported) == 1 and not list(tmp_path.iterdir())
    if command[0] == "calibrate":  # needs no engine, and tells what is wrong
        assert done.returncode == 2 and reported[0].startswith("nowhere: no such folder")
    else:
        assert done.returncode == 1 and "MUJOCO_GL='bogus'; unset it" in reported[0]
