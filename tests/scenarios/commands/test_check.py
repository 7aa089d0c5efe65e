"""The command `check`: limits on saved figures, with an exit code."""

import json

import pytest

ROWS = [
    {"model": m, "trials": "dynamic", "base": b, "encoder": "motor", "position_rmse_component_mm": v, "per_axis_mm": {}}
    for m, b, v in (("model_2", "fixed", 3.0), ("model_2", "dynamics", 2.0), ("model_3", "measured", 1.0))
]


@pytest.fixture
def run(tmp_path):
    (tmp_path / "evaluation.json").write_text(json.dumps({"rows": ROWS}))
    return tmp_path


def test_a_figure_within_its_limit_passes(run, tiago_twin):
    code, out, _ = tiago_twin("check", str(run), "--max", "model_2.mm=2.5", "--max", "model_3:measured.mm=1")
    assert code == 0
    assert out.splitlines()[0].split() == ["ok", "model_2.mm", "=", "2,", "at", "most", "2.5"]


def test_a_figure_beyond_its_limit_fails(run, tiago_twin):
    code, out, _ = tiago_twin("check", str(run), "--max", "model_2:fixed.mm=2.5", "--min", "model_2.mm=1")
    assert (code, out.split()[0]) == (1, "FAILED")


def test_the_truth_is_preferred_and_coverage_is_a_figure(run, tiago_twin):
    (run / "score.json").write_text(json.dumps({"rows": [ROWS[0] | {"skill": 0.9}], "coverage_95": 0.7}))
    assert tiago_twin("check", str(run), "--min", "model_2.skill=0.8", "--min", "coverage=0.7")[0] == 0
    assert tiago_twin("check", str(run), "--min", "coverage=0.71")[0] == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "no limit"),
        (("--max", "model_2.mm"), "write ROW.METRIC=VALUE"),
        (("--max", "model_2.mm=nan"), "write ROW.METRIC=VALUE"),
        (("--max", "model_9.mm=1"), "there are model_2"),
        (("--max", "model_2:plate.mm=1"), "there are model_2:fixed:motor:dynamic"),
        (("--max", "model_2.inches=1"), "no metric 'inches'; there are mm, norm"),
        (("--max", "model_2.per_axis_mm=1"), "no metric"),
        (("--max", "coverage=1"), "score.json: no such file"),
    ],
)
def test_wrong_limits_are_named(run, tiago_twin, arguments, message):
    code, _, error = tiago_twin("check", str(run), *arguments)
    assert (code, message in error) == (2, True), error
