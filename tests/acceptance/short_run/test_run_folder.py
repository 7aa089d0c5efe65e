"""The short variant of the default scenario, from the simulation to the report."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray

import calibration
from calibration.evaluation.bands import Bands
from calibration.prediction.predict import predictor
from calibration.recording.clock import Clock
from twin.truth import read_parameters

SAME = Clock("one", 0.0, 0.0, np.zeros((2, 2)), 0.0, 0.0)


@pytest.fixture(scope="module")
def result(quick_run):
    return quick_run


def figure(rows, model, base, trials="dynamic", name="position_rmse_component_mm"):
    found = [r for r in rows if (r["model"], r["base"], r["trials"], r["encoder"]) == (model, base, trials, "motor")]
    return found[0][name]


@pytest.fixture(scope="module")
def rows(result):
    return json.loads((result.folder / "score.json").read_text())["rows"]


def test_the_run_folder_is_complete(result):
    present = {str(p.relative_to(result.folder)) for p in result.folder.rglob("*") if p.is_file()}
    expected = {
        "scenario.yaml",
        "dataset/dataset.json",
        "dataset/nominal.urdf",
        "truth/truth.json",
        "estimate/estimate.json",
        "estimate/estimate.nc",
        "estimate/calibrated.urdf",
        "estimate/master_calibration.yaml",
        "estimate/zeros.yaml",
        "evaluation.json",
        "score.json",
        "report.html",
        "figures/twin.png",
    }
    assert expected <= present
    trials = json.loads((result.folder / "dataset/dataset.json").read_text())["trials"]
    assert {f"dataset/{t['file']}" for t in trials} | {f"truth/{t['file']}" for t in trials} <= present


def test_each_step_of_the_ladder_is_a_step_down(result, rows):
    assert result.estimate.status == "calibrated"
    nominal, registration = figure(rows, "nominal", "fixed"), figure(rows, "registration", "fixed")
    assert registration < nominal
    assert figure(rows, "model_2", "fixed") < 0.5 * min(nominal, registration)
    assert figure(rows, "model_2", "measured") < 0.5 * figure(rows, "registration", "measured")
    assert figure(rows, "model_2", "measured") < figure(rows, "model_2", "fixed")
    angle = {
        m: figure(rows, m, "measured", name="orientation_rmse_deg") for m in ("nominal", "registration", "model_2")
    }
    assert angle["model_2"] < 0.5 * angle["registration"] < 0.5 * angle["nominal"]


def test_the_dataset_holds_no_seed_and_no_drawn_value(result):
    text = (result.folder / "dataset/dataset.json").read_text()
    assert "seed" not in text
    drawn = [p for p in read_parameters(result.folder / "truth/truth.json") if p.name.startswith(("geometry", "link."))]
    assert len(drawn) > 48
    assert not [p.name for p in drawn if repr(abs(p.value))[:8] in text]


def test_play_is_read_back_from_a_recording(result):
    """arm_7 carries next to no load: its encoders differ by the play, and by the link encoder's own waves."""
    dataset = calibration.load(result.folder / "dataset")
    trial = next(t for e, t in dataset.trials("calibration") if e.id == "sweep_arm_7_joint")
    truth = {p.name: p.value for p in read_parameters(result.folder / "truth/truth.json")}
    j = trial.joint.index("arm_7_joint")
    waves = sum(abs(truth[f"encoder.arm_7_joint.link.{w}"]) for w in ("cos1", "sin1", "cos2", "sin2"))
    low, high = np.percentile((trial.q_motor - trial.q_link)[:, j], [5.0, 95.0])
    assert high - low == pytest.approx(truth["backlash.arm_7_joint.gap"], abs=1e-3 + 2 * waves)
    assert high - low > 0.8 * truth["backlash.arm_7_joint.gap"]


def test_clocks_come_back(result):
    truth = {p.name: p.value for p in read_parameters(result.folder / "truth/truth.json")}
    for instrument, tolerance in (("robot", 1e-3), ("plate", 5e-3)):
        clock = result.estimate.clock(instrument)
        t = np.linspace(120.0, 300.0, 20)
        true = t * (1.0 + truth[f"clock.{instrument}.drift"]) + truth[f"clock.{instrument}.offset"]
        assert np.sqrt(np.mean((clock.to_mocap(t) - true) ** 2)) < tolerance, instrument


def test_every_parameter_of_the_truth_is_judged_once(result):
    score = json.loads((result.folder / "score.json").read_text())
    names = [p["name"] for p in score["parameters"]]
    true = [p.name for p in read_parameters(result.folder / "truth/truth.json")]
    derived = [name for name in names if name.startswith(("suspension.K.", "suspension.C."))]
    assert sorted(names) == sorted(true + derived) and len(set(names)) == len(names)
    assert {p["status"] for p in score["parameters"]} <= {"estimated", "combined", "not_identifiable", "not_estimated"}
    floor = [r for r in score["rows"] if r["model"] == "floor"]
    assert floor and all(r["skill"] == 1.0 for r in floor)


def test_other_programs_open_every_file(result):
    for path in [*result.folder.glob("dataset/trials/*.nc"), *result.folder.glob("truth/trials/*.nc")]:
        with xarray.open_dataset(path, engine="netcdf4", decode_times=False) as data:
            for name, variable in data.variables.items():
                assert variable.dtype.kind not in "fi" or "units" in variable.attrs, (path.name, name)


def test_roll_and_pitch_of_the_base_are_predicted_from_the_plate(result, base_r2):
    """Without its markers beyond the first second, on swings no stage has seen; inverse dynamics: test_seeds.py."""
    r2 = base_r2(result.folder, result.estimate, "plate")
    assert r2.min() >= 0.95
    reported = {b["source"]: b for b in json.loads((result.folder / "score.json").read_text())["base"]}
    assert [reported["plate"]["roll_r2"], reported["plate"]["pitch_r2"]] == pytest.approx(r2, rel=1e-9)


def test_the_papers_models_keep_their_order(rows):
    def mm(model, base):
        return figure(rows, model, base)

    assert mm("model_1", "plate") <= mm("nominal", "fixed")
    assert mm("model_2", "plate") < min(mm("model_1", "plate"), mm("registration", "plate"))
    assert mm("model_3", "plate") <= min(1.10 * mm("model_2", "plate"), 5.7)
    assert figure(rows, "model_3", "plate", name="orientation_rmse_deg") <= 2.71


def test_one_estimate_is_scored_under_both_protocols(result):
    found = json.loads((result.folder / "evaluation.json").read_text())
    assert [(p["protocol"], p["model"]) for p in found["protocols"]] == [
        (protocol, model) for protocol in ("public", "ours") for model in ("nominal", "model_1", "model_2", "model_3")
    ]
    reported = {(x["joint"], x["regime"]): x for x in found["regimes"]}
    assert {(f"arm_{k}_joint", r) for k in range(1, 8) for r in ("unseen_motion", "static")} <= reported.keys()
    assert all(x["n"] > 0 and x["discrepancy_before_mrad"] > 0.0 for x in reported.values())
    better = {tuple(c["b"]): c["finding"] for c in found["comparisons"]}
    assert better["model_2", "plate"] == "better"
    assert better["model_1", "plate"] != "worse"


def test_a_base_that_slips_loads_the_links_as_predicted_where_it_is_measured(result):
    """Its markers do where it was not identified."""
    dataset = calibration.load(result.folder / "dataset")
    entry = dataset.entries("validation", "swing")[0]
    trial, predict = dataset.read(entry), predictor(result.estimate, dataset)
    poses = predict.poses(entry, trial)
    assert poses.geared("measured") is poses.geared("plate")
    still = replace(predict, bundled=replace(predict.bundled, stick_slip=None)).poses(entry, trial)
    torques = [still.geared(source).loads.torque for source in ("measured", "fixed")]
    assert np.abs(np.subtract(*torques)).max() > 0.1


def test_white_noise_of_the_base_s_markers_is_not_in_the_band_of_a_dwell(result):
    dataset = calibration.load(result.folder / "dataset")
    entry = dataset.entries("validation", "swing")[0]
    trial, predict = dataset.read(entry), predictor(result.estimate, dataset)
    bands, predicted = Bands(result.estimate, dataset.description, predict.robot), predict(entry, trial)
    rows = [
        {(p.model, p.base): p.covariance for p in bands.on(predicted, e, trial).rows if p.encoder == "motor"}
        for e in (entry, entry.model_copy(update={"kind": "static"}))
    ]
    moving, still = (np.trace(of["full", "measured"], axis1=1, axis2=2) for of in rows)
    assert np.nanmedian(np.sqrt((moving - still) / 3.0)) == pytest.approx(2e-4, rel=0.5)  # 0.1 mm of a marker, at 0.8 m
    np.testing.assert_array_equal(*(of["full", "plate"] for of in rows))


def test_links_that_inverse_dynamics_let_stop_elsewhere_widen_the_band_of_their_rows(result):
    """By what links err at rest in calibration dwells, on a base that inverse dynamics move."""
    dataset, parts = calibration.load(result.folder / "dataset"), result.estimate.bundle
    assert (parts.at_rest_by_dynamics > 0.0).all() and parts.by_dynamics.at_rest is parts.at_rest_by_dynamics
    wide = replace(parts, at_rest_by_dynamics=parts.at_rest + 5e-3)
    entry = dataset.entries("validation", "swing")[0]
    trial, predict = dataset.read(entry), predictor(result.estimate, dataset)
    rows = [
        {
            (p.model, p.base): p.covariance
            for p in bands.on(predict(entry, trial), entry, trial).rows
            if p.encoder == "motor"
        }
        for of in (parts, wide)
        for bands in [Bands(replace(result.estimate, bundle=of), dataset.description, predict.robot)]
    ]
    np.testing.assert_array_equal(*(of["full", "plate"] for of in rows))
    narrow, wider = (np.nanmax(np.trace(of["full", "dynamics"], axis1=1, axis2=2)) for of in rows)
    assert wider > 2.0 * narrow
