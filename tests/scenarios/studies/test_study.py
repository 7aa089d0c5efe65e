import json

import numpy as np
import pytest
from typer.testing import CliRunner

from scenarios import load
from scenarios.commands.main import app
from scenarios.datasets.index import Row
from scenarios.datasets.run_spec import Magnitude, run_name
from scenarios.files.errors import ScenarioError
from scenarios.studies import statistics
from scenarios.studies.effect_power import Power, entry, power, smallest
from scenarios.studies.matched_run import matched


def row(i, coverage=0.9, detected=1.0):
    figures = {"coverage_95": coverage, "nees_per_dof": 2.0, "detected": detected, "model_2_mm": 1.0 + i}
    return Row(i, "ok", magnitudes=tuple(Magnitude(n, v) for n, v in figures.items()))


def test_a_share_has_its_exact_binomial_interval():
    found = statistics.share(9, 10)
    # Clopper-Pearson by its definition: the tail probabilities at the bounds are 2.5 %
    k = np.arange(11)

    def law(p):
        from math import comb

        return np.array([comb(10, j) * p**j * (1 - p) ** (10 - j) for j in k])

    assert law(found.low)[9:].sum() == pytest.approx(0.025, abs=1e-6)
    assert law(found.high)[:10].sum() == pytest.approx(0.025, abs=1e-6)


def test_a_means_interval_holds_as_often_as_it_says():
    rng = np.random.default_rng(0)
    found = [statistics.mean(x) for x in rng.normal(3.0, 1.0, size=(4000, 6))]
    assert np.mean([f.low < 3.0 < f.high for f in found]) == pytest.approx(0.95, abs=0.01)
    assert np.isnan(statistics.mean(np.array([1.0])).low)


def test_a_level_counts_what_failed_as_not_detected():
    found = statistics.level("30", [row(0), row(1, 0.8, 0.0), Row(2, "failed", "no rank"), Row(3, "killed", "crash")])
    assert (found.n, found.calibrated.value, found.detected.value) == (4, 0.5, 0.25)
    assert (found.coverage_95.value, found.nees_per_dof, found.model_2_mm) == pytest.approx((0.85, 2.0, 1.5))


def test_parameters_are_judged_over_the_runs(tmp_path):
    rng = np.random.default_rng(1)
    rows = [row(i) for i in range(200)] + [Row(200, "failed")]
    for i in range(200):
        folder = tmp_path / "runs" / run_name(i)
        folder.mkdir(parents=True)
        good = {"name": "a", "unit": "m", "truth": 1.0, "estimate": 1.0 + 0.1 * rng.normal(), "sigma": 0.1}
        narrow = {**good, "name": "b", "estimate": 1.5 + 0.1 * rng.normal(), "sigma": 0.2}
        unknown = {**good, "name": "c", "estimate": None, "sigma": None}
        content = {"parameters": [good, unknown], "combinations": [narrow]}
        (folder / "score.json").write_text(json.dumps(content))
    a, b = statistics.parameters(tmp_path, rows)
    assert (a.name, a.n, a.unit) == ("a", 200, "m")
    assert a.bias == pytest.approx(0.0, abs=0.03)
    assert a.rmse == pytest.approx(0.1, rel=0.15)
    assert a.coverage_95 == pytest.approx(0.95, abs=0.05)
    assert b.bias == pytest.approx(0.5, abs=0.03)
    assert b.coverage_95 < 0.2


@pytest.mark.parametrize("vary", ["twin.campaign.calibration_postures", "twin.campaign.calibration_postures=12,,20"])
def test_a_wrong_vary_is_reported(tmp_path, vary):
    command = ["study", "power", "short", "-n", "2", "--out", str(tmp_path / "s"), "--vary", vary]
    assert isinstance(CliRunner().invoke(app, command).exception, ScenarioError)
    assert not (tmp_path / "s").exists()


@pytest.mark.slow
def test_more_postures_show_the_gain_more_clearly(tmp_path):
    vary = "twin.campaign.calibration_postures=8,20"
    command = ["study", "power", "short", "-n", "8", "--out", str(tmp_path / "s"), "--vary", vary, "--workers", "2"]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    few, many = json.loads((tmp_path / "s" / "study.json").read_text())["levels"]
    assert few["detected"]["value"] <= many["detected"]["value"]
    assert many["calibrated"]["value"] == 1.0
    assert many["detected"]["value"] >= 0.75
    assert json.loads((tmp_path / "s/level_1/runs/000000/score.json").read_text())["rows"]


def test_a_matched_robot_is_a_function_of_its_seed_and_its_intervals_hold(tmp_path):
    scenario = load("short", ["twin.campaign.calibration_postures=40"])
    found = []
    for seed in (0, 0, *range(1, 7)):
        folder = tmp_path / str(len(found))
        folder.mkdir()
        found.append(matched(scenario.model_copy(update={"seed": seed}), folder))
    assert found[0] == found[1] != found[2]
    figures = [{m.name: m.value for m in one} for one in found[1:]]
    n = sum(f["n_judged"] for f in figures)
    held = sum(f["coverage_95"] * f["n_judged"] for f in figures)
    assert n == 7 * 36
    assert 0.91 < held / n < 0.98
    assert all(f["model_2_mm"] < 0.3 * f["registration_mm"] and f["detected"] == 1.0 for f in figures)
    assert len(json.loads((tmp_path / "0" / "score.json").read_text())["combinations"]) > 10


def test_a_large_effect_is_seen_by_its_name_in_matched_robots():
    (found,) = power(load("short", ["twin.campaign.calibration_postures=40"]), "load", 2, (3e-2,))
    assert (found.seen.value, found.misnamed.value) == (1.0, 0.0) and 2.0 < found.hand_mm < 60.0


def test_the_smallest_effect_is_the_one_from_which_on_all_are_seen():
    def one(size, seen):
        return Power("load", size, 2.0 * size, 10, statistics.share(round(10 * seen), 10), statistics.share(0, 10))

    assert smallest([one(0.0, 0.0), one(1.0, 0.9), one(2.0, 0.5), one(4.0, 0.8), one(8.0, 1.0)]) == 8.0
    assert entry([one(0.0, 1.0), one(1.0, 0.5)])["smallest_seen_mm"] is None


@pytest.mark.slow
def test_nothing_wrong_in_nothing_significant_out():
    (found,) = power(load("short", ["seed=100"]), "load", 500, (0.0,))
    assert found.seen.value * 500 <= 11  # 99 % of the binomial law of 1 %


def test_a_study_of_matched_robots_needs_no_simulation(tmp_path):
    out = tmp_path / "study"
    result = CliRunner().invoke(app, ["study", "coverage", "short", "-n", "3", "--matched", "--out", str(out)])
    assert result.exit_code == 0, result.output
    content = json.loads((out / "study.json").read_text())
    assert content["levels"][0]["n"] == 3
    assert {p["name"] for p in content["parameters"]} >= {"geometry.arm_3_joint.z", "encoder.arm_4_joint.motor.offset"}
    assert not list((out / "runs").rglob("*.nc"))
