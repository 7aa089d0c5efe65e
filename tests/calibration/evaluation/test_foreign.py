"""Other people's calibrations: a URDF with zeros, a JSON of parameters, predicted poses."""

import csv
import json
import re
from dataclasses import replace

import netCDF4
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibration import evaluate, load_estimate, save_estimate
from calibration.errors import InputError
from calibration.evaluation import read_submission
from calibration.evaluation.pose_errors import pose_errors
from calibration.evaluation.submitted_poses import check_poses, doubts
from calibration.numerics.lie import compose, inverse
from calibration.prediction import predict
from calibration.prediction.foreign import check_names, registered

ROW = ("model_2", "measured", "motor")


@pytest.fixture(scope="module")
def saved(estimate, tmp_path_factory):
    folder = tmp_path_factory.mktemp("estimate")
    save_estimate(estimate, folder)
    return folder


@pytest.fixture(scope="module")
def poses(estimate, dataset):
    """Trial, time and pose of one row of ours."""
    return [
        (trial.trial_id, trial.t, row.T_lab_hand)
        for trial in predict(estimate, dataset)
        for row in trial.rows
        if (row.model, row.base, row.encoder) == ROW
    ]


def mm(evaluation, model, base, trials="dynamic"):
    return evaluation.row(model, trials, base).metrics.position_rmse_component_mm


def test_our_urdf_with_its_zeros_scores_as_the_estimate(saved, dataset, evaluation):
    found = evaluate(load_estimate(saved / "calibrated.urdf", saved / "zeros.yaml"), dataset)
    for trials in ("dynamic", "static"):
        assert mm(found, "calibrated", "measured", trials) == pytest.approx(mm(evaluation, *ROW[:2], trials), rel=0.02)
    bare = evaluate(load_estimate(saved / "calibrated.urdf"), dataset)
    assert mm(bare, "calibrated", "measured") > 1.5 * mm(found, "calibrated", "measured"), "zeros count"
    assert any("marker frames registered on" in v.message for v in found.verdicts)


@pytest.mark.parametrize(
    "text", ["joint,offset\narm_1_joint,0.01\n", "- {joint: arm_1_joint, offset: 0.01}\n", "arm_1_joint: 0.01\n"]
)
def test_zeros_are_read_from_csv_list_and_mapping(saved, tmp_path, text):
    path = tmp_path / ("zeros.csv" if text.startswith("joint") else "zeros.yaml")
    path.write_text(text)
    model = load_estimate(saved / "calibrated.urdf", path).models[0]
    assert [(p.name, p.value) for p in model.parameters] == [("encoder.arm_1_joint.motor.offset", 0.01)]


def test_a_urdf_of_another_robot_is_rejected_by_name(tmp_path, dataset):
    (tmp_path / "other.urdf").write_text('<robot name="other"><link name="base_footprint"/></robot>')
    with pytest.raises(InputError, match="not a URDF of this robot"):
        evaluate(load_estimate(tmp_path / "other.urdf"), dataset)


def written(folder, **models):
    content = {"models": {name: {"parameters": parameters} for name, parameters in models.items()}}
    (folder / "estimate.json").write_text(json.dumps(content))
    return load_estimate(folder / "estimate.json")


def test_another_program_s_models_become_rows_and_agree_with_ours(saved, dataset, evaluation, tmp_path):
    parameters = json.loads((saved / "estimate.json").read_text())["models"]["model_2"]["parameters"]
    parameters = [{"name": p["name"], "value": p["value"], "unit": p["unit"]} for p in parameters]
    found = evaluate(replace(written(tmp_path, mine=parameters), clocks=load_estimate(saved).clocks), dataset)
    assert {r.model for r in found.rows} == {"nominal", "mine"}
    for trials in ("dynamic", "static"):
        assert mm(found, "mine", "measured", trials) == pytest.approx(mm(evaluation, *ROW[:2], trials), rel=1e-9)


@pytest.mark.parametrize(
    ("parameter", "message"),
    [
        ({"name": "geometry.arm_1_jont.x", "value": 0.0}, "no joint 'arm_1_jont'; the nearest known is 'arm_1_joint'"),
        ({"name": "geometry.arm_1_joint.xx", "value": 0.0}, "nearest known is 'geometry.arm_1_joint.x'"),
        ({"name": "frame.tool.hnd.x", "value": 0.0}, "nearest known is 'frame.tool.hand.x'"),
        ({"name": "geometry.arm_1_joint.x", "value": 0.1, "unit": "mm"}, "unit 'mm'; it must be 'm'"),
        ({"name": "geometry.arm_1_joint.x", "value": 1.2}, "1.2 m is no calibration's; values are in m and rad"),
        ({"name": "encoder.arm_5_joint.motor.offset", "value": 6.9}, "6.9 rad is no calibration's"),
        ({"name": "encoder.arm_5_joint.motor.offset", "value": float("nan")}, "finite number"),
    ],
)
def test_unknown_joints_names_and_units_are_rejected(dataset, tmp_path, parameter, message):
    with pytest.raises(InputError, match=message):
        evaluate(written(tmp_path, mine=[parameter]), dataset)


def test_every_name_that_our_stages_write_is_known(dataset, tmp_path):
    names = [f"{part}.arm_1_joint.{of}" for part, of in (("hysteresis", "slip"), ("gear", "damping"))]
    names += ["contact.drive_left.friction", "flexibility.torso.krx"]
    check_names(written(tmp_path, mine=[{"name": name, "value": 0.1} for name in names]), dataset)
    with pytest.raises(InputError, match="no joint 'arm_9_joint'"):
        check_names(written(tmp_path, mine=[{"name": "hysteresis.arm_9_joint.slip", "value": 0.1}]), dataset)


def write_csv(path, poses, columns=("qw", "qx", "qy", "qz")):
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["trial", "t", "x", "y", "z", *columns])
        for trial, t, T in poses:
            for time, pose in zip(t, T, strict=True):
                known = np.isfinite(pose).all()
                q = Rotation.from_matrix(pose[:3, :3]).as_quat(scalar_first=True) if known else np.full(4, np.nan)
                table.writerow([trial, repr(float(time)), *(repr(float(x)) for x in (*pose[:3, 3], *q))])
    return path


def write_netcdf(path, poses):
    with netCDF4.Dataset(path, "w") as file:
        for trial, t, T in poses:
            group = file.createGroup(trial)
            group.createDimension("t", len(t))
            group.createDimension("four", 4)
            group.createVariable("t", "f8", ("t",))[:] = t
            group.createVariable("T", "f8", ("t", "four", "four"))[:] = T
    return path


def test_predicted_poses_score_as_the_row_they_are_of(poses, dataset, evaluation, tmp_path):
    for path in (write_csv(tmp_path / "mine.csv", poses), write_netcdf(tmp_path / "mine.nc", poses)):
        found = evaluate(read_submission(path), dataset)
        for trials in ("dynamic", "static"):
            assert mm(found, "mine", "submitted", trials) == pytest.approx(mm(evaluation, *ROW[:2], trials), rel=1e-9)


def test_a_urdf_scores_as_its_parameters_and_as_the_poses_that_it_predicts(dataset, tmp_path):
    """The three ways in with the same information: the datasheet's geometry, zeros, frames fitted to the postures."""
    (tmp_path / "mine.urdf").write_text(dataset.urdf)
    (tmp_path / "zeros.csv").write_text("joint,offset\narm_5_joint,0.1\n")
    urdf = load_estimate(tmp_path / "mine.urdf", tmp_path / "zeros.csv")
    found, known = evaluate(urdf, dataset), registered(urdf, dataset)
    rows = ((t.trial_id, t.t, r) for t in found.predicted for r in t.rows if (r.model, r.base) == ("mine", "measured"))
    path = write_netcdf(tmp_path / "mine.nc", [(trial, t, row.T_lab_hand) for trial, t, row in rows])
    poses = evaluate(read_submission(path), dataset)
    parameters = [{"name": p.name, "value": p.value, "unit": p.unit} for p in known.models[0].parameters]
    json_file = evaluate(replace(written(tmp_path, mine=parameters), clocks=known.clocks), dataset)
    for trials in ("dynamic", "static"):
        same = mm(poses, "mine", "submitted", trials), mm(json_file, "mine", "measured", trials)
        assert same == pytest.approx(2 * (mm(found, "mine", "measured", trials),), rel=1e-9)


def test_missing_trials_and_poses_are_warned_of(poses, dataset, tmp_path):
    trial, t, T = poses[0]
    holes = T.copy()
    holes[100:200] = np.nan
    found = evaluate(read_submission(write_netcdf(tmp_path / "mine.nc", [(trial, t, holes)])), dataset)
    messages = " ".join(v.message for v in found.verdicts)
    assert f"no prediction of trial {poses[1][0]}" in messages
    assert "is without a prediction and not scored" in messages


def test_times_between_the_camera_s_are_interpolated(poses, dataset, tmp_path):
    shifted = [(trial, t + 0.004, T) for trial, t, T in poses]
    found = evaluate(read_submission(write_netcdf(tmp_path / "mine.nc", shifted)), dataset)
    assert mm(found, "mine", "submitted") > 0.0


def changed(poses, change):
    return [(trial, t, change(T)) for trial, t, T in poses]


def in_mm(T):
    T = T.copy()
    T[:, :3, 3] *= 1e3
    return T


def in_another_frame(T):
    away = np.eye(4)
    away[:3, :3] = Rotation.from_rotvec([0.0, 0.0, 1.5]).as_matrix()
    away[:3, 3] = [3.0, -1.0, 0.5]
    return away @ T


def inverted(T):
    return inverse(T)


def with_another_hand(T):
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_rotvec([0.0, 1.5, 0.0]).as_matrix()
    return T @ turn


def order_mixed(T):
    known, mixed = np.isfinite(T).all(axis=(1, 2)), np.full_like(T, np.nan)
    q = Rotation.from_matrix(T[known, :3, :3]).as_quat()
    mixed[known] = compose(Rotation.from_quat(q, scalar_first=True).as_matrix(), T[known, :3, 3])
    return mixed


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (in_mm, "positions are in mm"),
        (in_another_frame, "another frame: a constant transform to the lab"),
        (with_another_hand, "another frame of the hand"),
        (inverted, "those of the lab in the hand"),
        (order_mixed, "order of the quaternions"),
    ],
)
def test_poses_in_other_units_or_frames_are_rejected_by_what_explains_them(poses, change, message):
    name, t, T = poses[0]
    with pytest.raises(InputError, match=f"{name}: .*{message}"):
        check_poses("mine.nc", name, t, change(T), T)


def test_a_submission_in_mm_is_rejected(poses, dataset, tmp_path):
    path = write_netcdf(tmp_path / "mine.nc", changed(poses, in_mm))
    with pytest.raises(InputError, match="mine.nc.*positions are in mm"):
        evaluate(read_submission(path), dataset)


def of_another_point(T):
    tool = np.eye(4)
    tool[:3, 3] = [0.0, 0.03, -0.05]
    return T @ tool


def moved(T):
    T = T.copy()
    T[:, :3, 3] += [0.02, 0.0, -0.01]
    return T


def turned_hand(T):
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_rotvec([0.0, 0.0, 0.2]).as_matrix()
    return T @ turn


def scaled(T):
    T = T.copy()
    T[:, :3, 3] *= 1.03
    return T


def late(T):
    return np.roll(T, 50, axis=0)


def mixed_later(T):
    T = T.copy()
    T[-len(T) // 4 :] = order_mixed(T[-len(T) // 4 :])
    return T


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (of_another_point, r"offset \(0\.0, 30\.0, -50\.0\) mm in the axes of the hand"),
        (moved, r"offset \(20\.0, 0\.0, -10\.0\) mm in the axes of the lab"),
        (turned_hand, r"offset \(.*, 11\.5\) deg in the axes of the hand"),
        (scaled, r"a scale of 1\.0300"),
        (late, r"a delay of 0\.50 s"),
        (mixed_later, "2[0-9].. % of the poses err by more than .*: there, the order of the quaternions"),
    ],
)
def test_a_doubtful_cause_of_the_error_is_warned_of_with_its_size(poses, change, message):
    _, t, T = poses[0]
    found = list(doubts(t, change(T), pose_errors(change(T), T)))
    assert any(re.search(message, text) for text in found), found


def test_doubts_are_among_the_verdicts(poses, dataset, tmp_path):
    path = write_netcdf(tmp_path / "mine.nc", changed(poses, of_another_point))
    messages = [v.message for v in evaluate(read_submission(path), dataset).verdicts]
    assert any(re.search(r"mine: xyz: a constant offset .* mm in the axes of the hand", text) for text in messages)


def test_good_poses_are_not_doubted(poses, dataset, tmp_path):
    good = evaluate(read_submission(write_netcdf(tmp_path / "good.nc", poses)), dataset)
    assert not [v.message for v in good.verdicts if "good" in v.message]


def test_matrices_that_are_no_poses_are_rejected(poses, tmp_path):
    path = write_netcdf(tmp_path / "transposed.nc", changed(poses, lambda T: np.swapaxes(T, 1, 2)))
    with pytest.raises(InputError, match="is T transposed"):
        read_submission(path)
    path = write_netcdf(tmp_path / "scaled.nc", changed(poses, lambda T: T * [[1.1], [1.1], [1.1], [1.0]]))
    with pytest.raises(InputError, match="R R' must be 1"):
        read_submission(path)


def test_a_urdf_in_mm_is_warned_of(dataset, tmp_path):
    text = re.sub(
        r'xyz="(.*?)"', lambda m: f'xyz="{" ".join(str(1e3 * float(x)) for x in m[1].split())}"', dataset.urdf
    )
    (tmp_path / "mine.urdf").write_text(text)
    messages = [v.message for v in evaluate(load_estimate(tmp_path / "mine.urdf"), dataset).verdicts]
    assert any(m.startswith("mine: ") and m.endswith("are its lengths in m?") for m in messages), messages


def test_calibrations_of_another_robot_are_warned_of(dataset, tmp_path):
    offsets = {f"arm_{k}_joint": 0.04 * (-1.0) ** k for k in range(1, 8)}
    zeros = [{"name": f"encoder.{joint}.motor.offset", "value": x} for joint, x in offsets.items()]
    found = {v.message for v in evaluate(written(tmp_path, mine=zeros), dataset).verdicts}
    assert any(re.search(r"mine: .* mm, the nominal robot .* mm; is it a calibration of this robot", m) for m in found)


def test_poses_that_are_all_missing_are_rejected(poses, tmp_path):
    path = write_netcdf(tmp_path / "none.nc", changed(poses, lambda T: np.full_like(T, np.nan)))
    with pytest.raises(InputError, match="no pose that is not NaN"):
        read_submission(path)


def test_a_mixed_order_of_the_quaternion_another_clock_and_other_trials_are_rejected(poses, dataset, tmp_path):
    path = write_csv(tmp_path / "mixed.csv", poses, ("qx", "qy", "qz", "qw"))
    with pytest.raises(InputError, match="order of the quaternions"):
        evaluate(read_submission(path), dataset)
    path = write_netcdf(tmp_path / "late.nc", [(trial, t + 1e4, T) for trial, t, T in poses])
    with pytest.raises(InputError, match="another clock"):
        evaluate(read_submission(path), dataset)
    path = write_netcdf(tmp_path / "other.nc", [("swing_9", t, T) for _, t, T in poses[:1]])
    with pytest.raises(InputError, match="no validation trial named swing_9"):
        evaluate(read_submission(path), dataset)
    path = write_csv(tmp_path / "norm.csv", [(n, t[:2], np.array(2 * [np.eye(4)])) for n, t, _ in poses])
    path.write_text(path.read_text().replace(",1.0,0.0,0.0,0.0", ",2.0,0.0,0.0,0.0"))
    with pytest.raises(InputError, match="norm"):
        read_submission(path)
