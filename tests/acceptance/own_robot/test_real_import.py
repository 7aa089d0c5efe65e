"""Public recordings of a real robot, under tests/data: one documented command each, then calibrate."""

import json
from pathlib import Path

import numpy as np
import pytest

from calibration import Compensator, calibrate, evaluate, fit_geometry, load
from calibration.errors import InputError
from calibration.stages.geometry.from_arrays import Widths
from scenarios.steps import import_export
from tests.doubles.real_postures import KINDS, ROOT, TWO_DAYS, one_marker, real_rows, spoilt_rows, written

REAL = ROOT / "tests/data"


def imported(tmp_path, file: str, mapping: str) -> tuple[Path, tuple[str, ...]]:
    notes = import_export.import_files("csv", [REAL / file], ROOT / "docs/mappings" / mapping, tmp_path / "dataset")
    return tmp_path / "dataset", notes


def test_static_postures_are_calibrated_and_say_what_is_missing(tmp_path):
    folder, _ = imported(tmp_path, "qualisys_2021-11-30_postures.csv", "qualisys_postures.yaml")
    estimate = calibrate(load(folder))
    said = {v.stage: v for v in estimate.verdicts}
    assert estimate.calibrated and estimate.main == "full"
    assert "37 postures" in said["registration"].message
    assert (said["suspension"].verdict, said["joints"].verdict) == ("missing", "missing")


@pytest.mark.slow
def test_arrays_give_the_answer_of_the_command(tmp_path):
    head, rows = real_rows()
    file = written(tmp_path / "qualisys_2021-11-30_postures.csv", head, rows[:26])
    import_export.import_files("csv", [file], ROOT / "docs/mappings/qualisys_postures.yaml", tmp_path / "dataset")
    dataset = load(tmp_path / "dataset")
    ((_, means),) = dataset.means("calibration")
    joints, tool = dataset.description.joint_names, dataset.description.tool_frame
    arrays = fit_geometry(
        dataset.urdf, joints, tool, means.q_motor, means.marker_position, "base_footprint", Widths(marker=2e-4)
    )
    xyz = np.array([m.xyz for m in dataset.description.hand_body.markers])
    estimate = calibrate(dataset, cross_validate=True)
    command = Compensator.of(estimate).points(xyz, means.q_motor)
    apart = np.linalg.norm(arrays.predict(means.q_motor) - command.positions, axis=2)
    left = np.linalg.norm(command.positions - means.marker_position, axis=2)
    assert np.sqrt((apart**2).mean()) < 0.02 * np.sqrt((left**2).mean())
    radii = arrays.predict_with_covariance(means.q_motor).radius_95
    np.testing.assert_allclose(radii, command.radius_95, rtol=0.01)
    factor = "standard deviations of full are multiplied by 1."
    assert factor in arrays.verdicts[-1].message and factor in " ".join(v.message for v in estimate.verdicts)


def test_a_second_file_is_predicted_within_its_band(tmp_path):
    head, rows = real_rows()
    order = np.random.default_rng(0).permutation(len(rows))
    files = [written(tmp_path / f"day{k + 1}.csv", head, rows[part]) for k, part in enumerate((order[:25], order[25:]))]
    import_export.import_files("csv", files, TWO_DAYS, tmp_path / "dataset")
    dataset = load(tmp_path / "dataset")
    found = evaluate(calibrate(dataset), dataset)
    rows = {p.model: p for p in found.points if p.marker == "all"}
    assert set(rows) == {"registration", "model_2", "full"}
    row = rows["full"]
    norm = {r.model: r.metrics.position_rmse_norm_mm for r in found.rows if r.trials == "static"}
    assert row.n == 48
    assert norm["full"] < norm["model_2"] < 0.7 * norm["registration"]
    assert row.rmse_norm_mm < 3.2 and 0.75 <= row.inside <= row.other_day_inside and row.band_95_mm < 6.0


def test_one_marker_on_the_hand_is_a_place_and_no_pose(tmp_path):
    head, rows = real_rows()
    order = np.random.default_rng(0).permutation(len(rows))
    files = [written(tmp_path / f"day{k + 1}.csv", head, rows[part]) for k, part in enumerate((order[:30], order[30:]))]
    import_export.import_files("csv", files, one_marker(tmp_path), tmp_path / "dataset")
    dataset = load(tmp_path / "dataset")
    estimate = calibrate(dataset, plan_next=True)
    said = " ".join(v.message for v in estimate.verdicts)
    assert estimate.calibrated and estimate.model("model_2").rank == 33
    assert "hand orientation is not observable" in said and "no posture identifies frame.tool.hand.rx" in said
    turn = {p.name: p for p in estimate.model("full").parameters}["frame.tool.hand.rx"]
    assert turn.status == "not_identifiable" and turn.sigma == pytest.approx(0.1)
    found = evaluate(estimate, dataset)
    norm = {r.model: r.metrics.position_rmse_norm_mm for r in found.rows if r.trials == "static"}
    assert norm["full"] < 0.85 * norm["registration"] and norm["full"] < 3.5
    found.save(tmp_path / "result")
    entries = json.loads((tmp_path / "result/evaluation.json").read_text())["rows"]
    assert {e["orientation_rmse_deg"] for e in entries} == {None}
    assert {(p.model, p.marker): p for p in found.points}["full", "all"].inside >= 0.75


def test_two_undrawn_markers_are_refused(tmp_path):
    head, rows = real_rows()
    files = [written(tmp_path / f"day{k + 1}.csv", head, part) for k, part in enumerate(np.array_split(rows, 2))]
    with pytest.raises(InputError, match="two markers show no frame of a body"):
        import_export.import_files("csv", files, one_marker(tmp_path, "BL, BR"), tmp_path / "dataset")


@pytest.mark.parametrize("kind", KINDS)
def test_wrong_rows_are_imported_and_named(tmp_path, kind):
    head, rows = real_rows()
    rng = np.random.default_rng(3)
    wrong = np.sort(rng.choice(len(rows), 4, replace=False))
    rows = spoilt_rows(rows, wrong, kind, rng)
    file = written(tmp_path / "qualisys_2021-11-30_postures.csv", head, rows)
    import_export.import_files("csv", [file], ROOT / "docs/mappings/qualisys_postures.yaml", tmp_path / "dataset")
    estimate = calibrate(load(tmp_path / "dataset"))
    reported = [v.message for v in estimate.verdicts if v.stage == "geometry" and v.verdict == "warning"]
    assert estimate.calibrated
    assert reported == [
        "4 of 37 postures contradict the others and were left out, counted from 0: "
        + ", ".join(f"postures {k}" for k in wrong)
    ]


def test_exchanged_labels_do_not_move_where_undrawn_markers_are_placed(tmp_path):
    head, rows = real_rows()
    rng = np.random.default_rng(14)
    wrong = np.sort(rng.choice(len(rows), 4, replace=False))
    placed = []
    for name, some in (("with", spoilt_rows(rows, wrong, "labels", rng)), ("without", np.delete(rows, wrong, axis=0))):
        file = written(tmp_path / name / "qualisys_2021-11-30_postures.csv", head, some)
        import_export.import_files(
            "csv", [file], ROOT / "docs/mappings/qualisys_postures.yaml", tmp_path / name / "dataset"
        )
        placed.append([body.placement for body in load(tmp_path / name / "dataset").description.bodies])
    np.testing.assert_allclose(*placed, atol=1e-3)


def test_base_and_plate_give_a_suspension_and_say_what_is_missing(tmp_path):
    folder, notes = imported(tmp_path, "vicon_forceplate_2023-09-20.csv", "vicon_forceplate.yaml")
    assert "action, lab axes, about the surface centre, moments in N.m, confirmed by its CoP" in notes[0]
    estimate = calibrate(load(folder))
    said = {(v.stage, v.verdict) for v in estimate.verdicts}
    assert {("registration", "missing"), ("geometry", "missing"), ("joints", "missing")} <= said
    assert estimate.calibrated and estimate.main == "model_1" and estimate.suspension is not None
    # the tilt of a TIAGo on its tyres, from the same log by other methods: 1.9e4 to 2.9e4 N.m/rad and above
    assert all(1e4 < estimate.suspension.K[i, i] < 1e5 for i in (3, 4))
    assert estimate.suspension.moves("plate")[3:5].all()
    assert not any(p.name.startswith("clock") for p in estimate.model("model_1").parameters)
