"""What the default scenario shows, whole: slow, run by `make slow`. Its ten other robots: test_seeds.py."""

import json

import pytest

from scenarios import load, run

pytestmark = pytest.mark.slow
SEVEN = [f"arm_{k}_joint" for k in range(1, 8)]


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    return run(load("humanoids2024"), tmp_path_factory.mktemp("run") / "default")


@pytest.fixture(scope="module")
def evaluation(result):
    return json.loads((result.folder / "evaluation.json").read_text())


@pytest.fixture(scope="module")
def score(result):
    return json.loads((result.folder / "score.json").read_text())


def figure(score, model, base, encoder="motor", name="position_rmse_component_mm"):
    rows = [r for r in score["rows"] if r["trials"] == "dynamic"]
    return next(r[name] for r in rows if (r["model"], r["base"], r["encoder"]) == (model, base, encoder))


@pytest.mark.parametrize("source", ["plate", "dynamics"])
def test_roll_and_pitch_of_the_base_are_predicted(result, score, base_r2, source):
    reported = next(b for b in score["base"] if b["source"] == source)
    assert [reported["roll_r2"], reported["pitch_r2"]] == pytest.approx(base_r2(result.folder, result.estimate, source))
    assert min(reported["roll_r2"], reported["pitch_r2"]) >= 0.95


@pytest.mark.parametrize("base", ["plate", "dynamics"])
def test_the_papers_models_keep_their_order(score, base):
    mm = {m: figure(score, m, base) for m in ("model_1", "registration", "model_2", "model_3")}
    assert mm["model_2"] < min(mm["model_1"], mm["registration"])
    assert mm["model_3"] <= min(1.10 * mm["model_2"], 5.7)
    assert figure(score, "model_3", base, name="orientation_rmse_deg") <= 2.71


@pytest.mark.parametrize("base", ["plate", "dynamics"])
def test_model_1_is_not_worse_than_nominal_or_it_is_said_why(evaluation, base):
    found = next(c for c in evaluation["comparisons"] if c["b"] == ["model_1", base])
    assert found["a"] == ["nominal", "fixed"] and found["reason"]
    assert found["finding"] in ("better", "no difference")


OPEN = pytest.mark.xfail(reason="43 % of 60: no load holds arm_1 on a side, docs/limits.md", strict=True)


@pytest.mark.parametrize("joint", [pytest.param(j, marks=OPEN) if j == "arm_1_joint" else j for j in SEVEN])
def test_the_printed_joint_model_explains_a_settled_repetition(evaluation, joint):
    found = next(x for x in evaluation["regimes"] if (x["joint"], x["regime"]) == (joint, "repetition"))
    assert found["cut_percent"] >= 60.0 and found["r2"] >= 0.85


def test_its_limits_are_shown_beside_it(result, evaluation):
    reported = {(x["joint"], x["regime"]) for x in evaluation["regimes"]}
    assert {(joint, regime) for joint in SEVEN for regime in ("unseen_motion", "static")} <= reported
    page = (result.folder / "report.html").read_text()
    assert "Other motions, held out: the rms falls" in page and "Static postures, held out: the rms falls" in page


def test_link_encoders_beat_motor_encoders_with_the_base_measured(score):
    assert figure(score, "model_3", "measured", "link") < figure(score, "model_2", "measured")
