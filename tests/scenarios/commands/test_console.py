"""What the command line shows."""

import io
import json
import re
import time
from types import SimpleNamespace

import pytest
from rich.console import Console

from calibration.verdict import Verdict
from scenarios.commands import console
from tests.doubles.run_folder import write_estimate, write_evaluation, write_score

ROW = {
    "model": "nominal",
    "trials": "static",
    "base": "fixed",
    "encoder": "motor",
    "position_rmse_component_mm": 13.3,
    "position_rmse_norm_mm": 23.04,
    "orientation_rmse_deg": 8.57,
}


def printed(table) -> str:
    stream = io.StringIO()
    Console(file=stream, width=100).print(table)
    return stream.getvalue()


def test_the_ladder_shows_rows_units_and_what_it_is_against(tmp_path):
    rows = [{**ROW, "trials": trials, "against": "mocap"} for trials in ("static", "all")]
    (tmp_path / "evaluation.json").write_text(json.dumps({"rows": rows}))
    text = printed(console.ladder(tmp_path))
    assert "against mocap" in text
    for words in ("per component [mm]", "norm [mm]", "RMSE [deg]"):
        assert words in text
    assert text.splitlines()[-1].split() == ["nominal", "fixed", "motor", "static", "13.30", "23.04", "8.570"]


def test_the_ladder_is_against_the_truth_where_there_is_one(tmp_path):
    (tmp_path / "evaluation.json").write_text(json.dumps({"rows": [{**ROW, "against": "mocap"}]}))
    (tmp_path / "score.json").write_text(json.dumps({"rows": [{**ROW, "against": "truth"}]}))
    assert "against truth" in printed(console.ladder(tmp_path))


def test_a_verdict_keeps_its_brackets():
    text = printed(console.verdicts([SimpleNamespace(stage="clocks", verdict="good", message="0.1 [ms]")]))
    assert "0.1 [ms]" in text


def test_time_left_passes_between_two_reports():
    stream = io.StringIO()
    with console._bars(Console(file=stream, force_terminal=True, width=100)) as show:
        show("calibrate", "", 0.0)
        time.sleep(0.1)
        show("calibrate", "bundle", 0.05)
        time.sleep(1.1)
    left = [int(n) for n in re.findall(r"(\d+) s left", stream.getvalue())]
    assert left[-1] < left[0]


def test_steps_are_lines_without_a_terminal(capfd, monkeypatch):
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    with console.progress() as show:
        for seconds, at in ((0, "a [1/3]"), (1, "b [2/3]"), (9, "c [3/3]")):
            now[0] += seconds
            show("simulate", at, seconds / 10)
        show("report", "", 0.0)
    assert capfd.readouterr() == ("", "simulate   0% a [1/3]\nsimulate  90% c [3/3], 1 s left\nreport\n")


@pytest.mark.parametrize("fails", [False, True])
def test_steps_are_bars_on_a_terminal(fails):
    stream = io.StringIO()
    terminal = Console(file=stream, force_terminal=True, color_system=None, width=100, _environ={"TERM": "xterm"})

    def work() -> None:
        with console._bars(terminal) as show:
            show("simulate", "around_x [1/3]", 0.5)
            show("calibrate", "geometry", 0.25)
            if fails:
                raise ValueError

    if fails:
        with pytest.raises(ValueError):
            work()
    else:
        work()
    last = {step: re.findall(rf"{step}[^%]*? (\d+)%", stream.getvalue())[-1] for step in ("simulate", "calibrate")}
    assert last == {"simulate": "100", "calibrate": "25" if fails else "100"}


def test_what_an_evaluation_says_is_reported(tmp_path):
    moved = [{"stage": "evaluation", "verdict": "warning", "message": "base moved during xyz"}]
    (tmp_path / "evaluation.json").write_text(json.dumps({"rows": [], "verdicts": moved}))
    assert console.remarks(tmp_path) == ["base moved during xyz"]
    (tmp_path / "evaluation.json").write_text(json.dumps({"rows": []}))
    assert console.remarks(tmp_path) == []


def test_a_run_ends_in_six_lines(tmp_path):
    write_evaluation(tmp_path)
    write_score(tmp_path)
    write_estimate(tmp_path / "estimate", Verdict("geometry", "warning", "arm_3 never moved"))
    evaluation = json.loads((tmp_path / "evaluation.json").read_text())
    evaluation["budget"] = {
        "whole_mm": 3.0,
        "shares": [],
        "next_steps": [],
        "sentence": "Of the 3.00 mm: joints 3.00; next: x.",
    }
    (tmp_path / "evaluation.json").write_text(json.dumps(evaluation))
    lines = console.summary(tmp_path)
    assert len(lines) == 6
    assert lines[0].startswith("Calibrated. Error of the hand on unseen moving trials: ")
    assert re.match(r"RMSE per component .*\[deg\]: nominal [\d.]+, [\d.]+; .*model_2 [\d.]+, [\d.]+", lines[1])
    assert lines[2] == "Of the 3.00 mm: joints 3.00."
    assert lines[3] == "Worst finding: warning, geometry: arm_3 never moved"
    assert re.match(r"Next: -[\d.]+ mm: measure the base", lines[4])
    assert lines[5] == f"Report: {tmp_path / 'report.html'}"
