"""A dataset of posture means: no time, no clocks, and yet a calibrated geometry."""

import json
from dataclasses import replace

import netCDF4
import numpy as np
import pytest

import mjcf
from calibration import calibrate, evaluate, load
from calibration.errors import InputError
from calibration.recording.posture_means import PostureMeans, holds_means, read_means, write_means
from calibration.recording.trial import sha256
from tests.doubles import rigid_robot

SIGMA = 5e-5


def means(truth: rigid_robot.Truth, n: int, seed: int = 0) -> PostureMeans:
    """Postures of the matched robot, hand markers in the frame of the base body."""
    rng = np.random.default_rng(seed)
    q = rigid_robot.near_postures(rng, n)
    xyz = np.array(rigid_robot.BODIES["gripper"][1])
    T = rigid_robot.hand_in_base(truth, q)
    p = np.einsum("nij,mj->nmi", T[:, :3, :3], xyz) + T[:, None, :3, 3] + SIGMA * rng.normal(size=(n, len(xyz), 3))
    names = tuple(f"gripper{i}" for i in range(len(xyz)))
    return PostureMeans(
        "m",
        rigid_robot.JOINTS,
        q + truth.offset,
        names,
        ("gripper",) * len(xyz),
        p,
        np.full(p.shape, SIGMA),
        np.zeros(q.shape),
    )


def dataset(folder, parts: dict[str, PostureMeans], **changes):
    description = rigid_robot.description([])
    base = {"name": "base", "link": "base_footprint", "markers": []}
    description |= {"bodies": [base, description["bodies"][1]], "marker_frame": "base"} | changes
    (folder / "trials").mkdir(parents=True)
    for role, part in parts.items():
        file = f"trials/{role}.nc"
        digest = write_means(folder / file, part)
        entry = {"id": role, "role": role, "kind": "static", "motion": role, "file": file, "sha256": digest}
        description["trials"].append(entry)
    (folder / "dataset.json").write_text(json.dumps(description))
    (folder / "nominal.urdf").write_text(mjcf.urdf())
    return folder


def test_means_come_back_bit_for_bit(tmp_path):
    some = means(rigid_robot.defects(2), 5)
    some.marker_position[1, 2] = np.nan
    first, second = (write_means(tmp_path / name, some) for name in ("a.nc", "b.nc"))
    back = read_means(tmp_path / "a.nc", "m")
    assert first == second == sha256(tmp_path / "a.nc") and holds_means(tmp_path / "a.nc")
    for name, value in vars(some).items():
        np.testing.assert_array_equal(getattr(back, name), value)


def test_geometry_is_calibrated_from_means_alone_and_predicts_others(tmp_path):
    truth = rigid_robot.defects(3)
    folder = dataset(tmp_path / "d", {"calibration": means(truth, 30), "validation": means(truth, 10, seed=1)})
    estimate = calibrate(load(folder))
    said = {v.stage: v.verdict for v in estimate.verdicts}
    assert said == {
        "clocks": "missing", "registration": "ok", "suspension": "missing", "geometry": "ok", "joints": "missing",
        "bundle": "missing",
    }  # fmt: skip
    assert estimate.calibrated and estimate.main == "full"
    ladder = evaluate(estimate, load(folder))
    rows = {r.model: r.metrics.position_rmse_norm_mm for r in ladder.rows if r.trials == "static"}
    assert {(r.base, r.encoder) for r in ladder.rows} == {("measured", "motor")}
    # three markers' noise at the hand: 0.05 mm a marker and axis; nominal is off by millimetres
    assert rows["model_2"] < 0.2 < 2.0 < rows["registration"] < rows["nominal"]


def test_occluded_markers_are_left_out_and_postures_without_a_pose_are_not_used(tmp_path):
    truth = rigid_robot.defects(3)
    some = means(truth, 30)
    some.marker_position[0, 0] = np.nan
    some.marker_position[1, :2] = np.nan
    estimate = calibrate(load(dataset(tmp_path / "d", {"calibration": some})), ["registration"])
    assert "from 29 postures" in estimate.verdicts[-1].message


def test_means_in_millimetres_are_refused(tmp_path):
    some = means(rigid_robot.defects(3), 30)
    estimate = calibrate(
        load(dataset(tmp_path / "d", {"calibration": replace(some, marker_position=1e3 * some.marker_position)}))
    )
    assert not estimate.calibrated and "millimetres" in estimate.verdicts[0].message


@pytest.mark.parametrize("std", [0.0, -1e-4, np.nan])
def test_means_without_noise_are_refused(tmp_path, std):
    some = means(rigid_robot.defects(1), 3)
    write_means(tmp_path / "a.nc", replace(some, marker_position_std=np.full(some.marker_position.shape, std)))
    with pytest.raises(InputError, match="marker_position_std is not above 0"):
        read_means(tmp_path / "a.nc")


def test_a_missing_variable_is_named(tmp_path):
    write_means(tmp_path / "a.nc", means(rigid_robot.defects(1), 3))
    with netCDF4.Dataset(tmp_path / "a.nc", "a") as file:
        file.renameVariable("marker_position_std", "std")
    with pytest.raises(InputError, match=r"has no variable \['marker_position_std'\]"):
        read_means(tmp_path / "a.nc")


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"marker_frame": "lab"}, "bodies without markers"), ({"marker_frame": "gripper"}, "bodies without markers")],
)
def test_a_body_without_markers_is_the_frame_of_the_positions_or_a_mistake(tmp_path, changes, words):
    folder = dataset(tmp_path / "d", {"calibration": means(rigid_robot.defects(1), 3)}, **changes)
    with pytest.raises(InputError, match=words):
        load(folder)
