import json
from dataclasses import replace

import netCDF4
import numpy as np
import pinocchio as pin
import pytest

from calibration import calibrate, evaluate, load, load_estimate, predictions, save_estimate
from calibration.errors import NotCalibrated, NotEnoughData
from calibration.evaluation.evaluate import frictions_shown
from calibration.evaluation.pose_errors import PoseErrors, dwell_means, pose_errors, row_metrics
from calibration.prediction.predicted_trial import PredictedTrial
from calibration.recording.schema import Wheel
from calibration.recording.trial import read_trial, write_trial
from tests.doubles import rigid_robot
from tests.doubles.edited_dataset import rewritten


def test_every_model_improves_on_the_one_before_it(evaluation):
    for trials in ("dynamic", "static"):
        for base in ("fixed", "measured"):
            rmse = [
                evaluation.row(m, trials, base).metrics.position_rmse_norm_mm
                for m in ("nominal", "registration", "model_2")
            ]
            assert rmse[0] > rmse[1] > 2.0 * rmse[2]


def test_without_play_or_noise_only_the_mocap_s_own_noise_is_left(tmp_path):
    truth = replace(rigid_robot.defects(2), marker_sigma=1e-5)
    dataset = load(rigid_robot.campaign(tmp_path / "dataset", truth, n_postures=14, plate=False))
    row = evaluate(calibrate(dataset, ["geometry"]), dataset).row("model_2", "static", "fixed")
    assert row.metrics.position_rmse_component_mm < 0.05
    assert row.metrics.orientation_rmse_deg < 0.01


def test_predictions_never_use_hand_markers_and_the_base_s_only_at_the_start_unless_measured(
    estimate, folder, tmp_path
):
    """Hand markers hidden, base markers hidden after the first second: the same fixed-base predictions, bit for bit."""

    def hide(trial):
        p = trial.marker_position.copy()
        p[:, trial.markers_of("gripper")] = np.nan
        p[np.ix_(trial.t_mocap > trial.t_mocap[0] + 1.0, trial.markers_of("base"))] = np.nan
        return replace(trial, marker_position=p)

    changed = load(rewritten(folder, tmp_path / "copy", {"xyz": hide, "others": hide}))
    whole = {(p.model, p.base, p.trial_id): p for p in predictions(estimate, load(folder))}
    for p in predictions(estimate, changed):
        before = whole[p.model, p.base, p.trial_id].T_lab_hand
        if p.base == "fixed":
            np.testing.assert_array_equal(p.T_lab_hand, before)
        else:  # a body some of whose markers are hidden gets its shape from the samples that show all of them
            rows = p.t <= p.t[0] + 1.0
            np.testing.assert_allclose(p.T_lab_hand[rows], before[rows], atol=1e-4)


def test_rows_of_a_ladder_are_complete_and_named_as_in_the_contract(evaluation, estimate, tmp_path):
    evaluation.save(tmp_path)
    found = json.loads((tmp_path / "evaluation.json").read_text())
    keys = {(r["model"], r["trials"], r["base"], r["encoder"], r["against"]) for r in found["rows"]}
    sources = ("fixed", "measured") if estimate.suspension is None else ("fixed", "plate", "dynamics", "measured")
    rows = [("nominal", b, "motor") for b in ("fixed", "measured")]
    rows += [("model_1", b, "motor") for b in sources[1:]] if estimate.suspension is not None else []
    rows += [(m, b, "motor") for m in ("registration", "model_2", "full") for b in sources]
    assert keys == {(m, t, b, e, "mocap") for m, b, e in rows for t in ("dynamic", "static", "all")}
    assert set(found["rows"][0]) == {
        "model", "trials", "base", "encoder", "against", "n", "position_rmse_component_mm", "position_rmse_norm_mm",
        "position_p95_norm_mm", "position_max_norm_mm", "orientation_rmse_deg", "orientation_rmse_component_deg",
        "orientation_max_deg", "per_axis_mm", "inside_95", "band_95_mm",
    }  # fmt: skip
    assert set(found["rows"][0]["per_axis_mm"]) == {"x", "y", "z"}


def test_a_base_on_wheels_that_is_taken_to_stay_has_no_band_without_a_suspension(estimate, dataset):
    alone = replace(estimate, suspension=None, bundle=None, main="model_2")
    bolted, on_wheels = (
        evaluate(alone, replace(dataset, description=dataset.description.model_copy(update={"wheels": wheels})))
        for wheels in ((), (Wheel(name="left", type="drive", centre=(0.0, 0.2, 0.1), contact=(0.0, 0.2, 0.0)),))
    )
    assert on_wheels.row("model_2", "dynamic", "fixed").inside_95 is None
    assert on_wheels.row("model_2", "dynamic", "measured").inside_95 is not None
    assert bolted.row("model_2", "dynamic", "fixed").inside_95 is not None


def test_saved_errors_give_the_rows_again(evaluation, tmp_path):
    evaluation.save(tmp_path)
    with netCDF4.Dataset(tmp_path / "evaluation.nc") as file:
        group = file["model_2/fixed/motor/xyz"]
        e = group.variables["scored_position_error"]
        assert e.units == "m"
        found = 1e3 * np.sqrt((np.asarray(e[...], dtype=float) ** 2).mean())
    row = evaluation.row("model_2", "dynamic", "fixed")
    assert found == pytest.approx(row.metrics.position_rmse_component_mm, rel=1e-5)


def test_saving_twice_gives_the_same_bytes(evaluation, tmp_path):
    evaluation.save(tmp_path / "a")
    evaluation.save(tmp_path / "b")
    for name in ("evaluation.json", "evaluation.nc"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_a_bare_urdf_and_a_foreign_estimate_are_scored_without_a_clock_of_their_own(
    estimate, evaluation, dataset, tmp_path
):
    save_estimate(estimate, tmp_path)
    found = evaluate(load_estimate(tmp_path / "calibrated.urdf"), dataset)
    assert {r.model for r in found.rows} == {"nominal", "calibrated"}
    mine = evaluation.row("nominal", "dynamic")
    assert found.row("nominal", "dynamic").metrics.position_rmse_norm_mm == pytest.approx(
        mine.metrics.position_rmse_norm_mm
    )


def test_the_first_second_is_not_scored_and_a_dwell_counts_once(evaluation, dataset):
    for trace in evaluation.traces:
        expected = 4 if trace.kind == "static" else int((trace.t > trace.t[0] + 1.0).sum())
        assert abs(len(trace.scored) - expected) <= 2


def test_an_estimate_that_must_not_be_used_is_not_scored(estimate, dataset):
    with pytest.raises(NotCalibrated):
        evaluate(replace(estimate, status="not_calibrated"), dataset)


def test_there_must_be_a_trial_of_the_role(estimate, dataset):
    with pytest.raises(NotEnoughData, match="confirmation"):
        evaluate(estimate, dataset, role="confirmation")


def test_the_figures_are_those_of_their_definitions():
    rng = np.random.default_rng(0)
    e, phi = 1e-3 * rng.normal(size=(50, 3)), 1e-2 * rng.normal(size=(50, 3))
    found = row_metrics(PoseErrors(e, phi))
    norm = [1e3 * np.sqrt(x @ x) for x in e]
    assert found.n == 50
    assert found.position_rmse_component_mm == pytest.approx(1e3 * np.sqrt(sum(x @ x for x in e) / 150.0))
    assert found.position_rmse_norm_mm == pytest.approx(np.sqrt(3.0) * found.position_rmse_component_mm)
    assert found.position_max_norm_mm == pytest.approx(max(norm))
    assert found.position_p95_norm_mm == pytest.approx(sorted(norm)[46] + 0.55 * (sorted(norm)[47] - sorted(norm)[46]))
    assert found.orientation_rmse_deg == pytest.approx(np.sqrt(sum(np.degrees(np.sqrt(x @ x)) ** 2 for x in phi) / 50))
    assert found.orientation_max_deg == pytest.approx(np.degrees(np.sqrt((phi**2).sum(axis=1)).max()))
    assert found.per_axis_mm[1] == pytest.approx(1e3 * np.sqrt((e[:, 1] ** 2).mean()))


def test_errors_are_in_the_lab_and_geodesic():
    T = rigid_robot.se3(np.array([1.0, 2.0, 3.0, 0.5, -0.2, 1.0]))
    turn = np.array([0.3, -0.1, 0.2])
    moved = T.copy()
    moved[:3, :3] = pin.exp3(turn) @ T[:3, :3]
    moved[:3, 3] += [0.01, 0.02, 0.03]
    found = pose_errors(moved[None], T[None])
    np.testing.assert_allclose(found.position[0], [0.01, 0.02, 0.03], atol=1e-15)
    np.testing.assert_allclose(found.rotation[0], turn, atol=1e-12)


def test_a_dwell_s_error_is_its_mean_and_unseen_dwells_do_not_count():
    t = np.arange(10.0)
    e = np.column_stack([t, t, t])
    e[7:] = np.nan
    found = dwell_means(t, PoseErrors(e, e), np.array([[0.0, 2.0], [3.0, 4.0], [8.0, 9.0]]))
    np.testing.assert_allclose(found.position[:2, 0], [1.0, 3.5])
    assert np.isnan(found.position[2]).all() and len(found.complete) == 2
    with pytest.raises(NotEnoughData):
        row_metrics(PoseErrors(e[7:], e[7:]))


def test_recordings_survive_their_files(dataset, tmp_path):
    trial = dataset.read(dataset.description.trials[0])
    write_trial(tmp_path / "again.nc", trial)
    again = read_trial(tmp_path / "again.nc", trial.id)
    np.testing.assert_array_equal(again.t_robot, trial.t_robot)
    np.testing.assert_array_equal(again.marker_position, trial.marker_position)


def test_a_held_out_trial_in_which_the_base_was_moved_is_named(estimate, evaluation, folder, tmp_path):
    def push(trial):
        p = trial.marker_position.copy()
        p[trial.t_mocap > trial.t_mocap.mean()] += [0.02, 0.0, 0.0]
        return replace(trial, marker_position=p)

    found = evaluate(estimate, load(rewritten(folder, tmp_path / "copy", {"xyz": push})))
    found.save(tmp_path)
    reported = json.loads((tmp_path / "evaluation.json").read_text())["verdicts"]
    assert [(v["stage"], v["verdict"]) for v in reported] == [("evaluation", "warning")]
    assert (
        "base moved during xyz by 20.0 mm, 0 mrad" in reported[0]["message"] and "others" not in reported[0]["message"]
    )
    assert evaluation.verdicts == ()


def test_friction_that_a_new_load_shows_is_said():
    trials = [PredictedTrial("heavy", "swing", np.zeros(0), frictions=(("arm_7_joint", 0.148, 0.109),))]
    (said,) = frictions_shown([PredictedTrial("usual", "swing", np.zeros(0)), *trials])
    assert said.verdict == "ok" and "arm_7_joint 0.15 N.m in heavy (calibrated 0.11)" in said.message
    assert list(frictions_shown([])) == []
