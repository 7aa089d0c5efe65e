import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calibration import calibrate, load, save_estimate
from calibration.context import Context
from calibration.errors import InputError, NoSuchElement, NotEnoughData
from calibration.inference.parameters import Model, Parameter
from calibration.pipeline import _concluded
from calibration.recording.trial import sha256
from calibration.robot.laboratory import Laboratory
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.stages.stage import StageInput
from calibration.verdict import Verdict
from tests.doubles import rigid_robot
from tests.doubles.edited_dataset import rewritten

FEW = ("postures", "sweep4")


@pytest.fixture(scope="module")
def few(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The postures and one sweep of the campaign."""
    copy = Path(shutil.copytree(folder, tmp_path_factory.mktemp("few") / "dataset"))
    listed = json.loads((copy / "dataset.json").read_text())
    listed["trials"] = [t for t in listed["trials"] if t["id"] in FEW]
    (copy / "dataset.json").write_text(json.dumps(listed))
    return copy


def refused(folder: Path, out: Path | None = None) -> str:
    estimate = calibrate(load(folder), ["geometry"])
    if out is not None:
        save_estimate(estimate, out)
    assert estimate.status == "not_calibrated"
    return " | ".join(v.message for v in estimate.verdicts if v.verdict == "refused")


def test_intervals_include_what_a_warning_s_cause_may_have_moved(estimate, dataset):
    name, off = "encoder.arm_2_joint.motor.offset", 0.01
    warned = Verdict("reading", "warning", "readings of arm_2_joint slipped", (((name, off),),))
    data = StageInput(Laboratory(dataset.urdf, dataset.description))
    found = _concluded(Context(data, replace(estimate, verdicts=(warned,))))
    before, after = ({p.name: p for p in e.model("model_2").parameters} for e in (estimate, found))
    assert after[name].sigma == pytest.approx(np.hypot(before[name].sigma, off))
    assert {n for n in before if after[n] != before[n]} == {name}


def test_forces_of_the_base_include_what_a_plate_s_weight_is_off(estimate, dataset):
    springs = (("suspension.K.11", "N/m", 4e4), ("slip.body_c", "N.s/m", 4.0), ("contact.left.mu", "-", 0.5))
    parameters = tuple(Parameter(n, unit, 0.0, value, 0.0, "estimated") for n, unit, value in springs)
    weighed = Verdict("suspension", "ok", "plate", ((("plate.scale", -0.1),),))
    models = (Model("model_1", parameters, covariance=np.zeros((3, 3))),)
    data = StageInput(Laboratory(dataset.urdf, dataset.description))
    (after,) = _concluded(Context(data, replace(estimate, models=models, verdicts=(weighed,)))).models
    np.testing.assert_allclose([p.sigma for p in after.parameters], [4e3, 0.4, 0.0])


def test_gears_include_what_the_links_masses_are_off(estimate, dataset):
    gears = (
        ("gear.arm_1_joint.compliance", 2e-4),
        ("friction.arm_1_joint.coulomb", 0.5),
        ("backlash.arm_1_joint.gap", 1e-3),
    )
    parameters = tuple(Parameter(n, "", 0.0, value, 0.0, "estimated") for n, value in gears)
    heavier = Verdict("suspension", "warning", "plate", ((("links.masses", 0.2),),))
    models = (Model("model_1", parameters, covariance=np.zeros((3, 3))),)
    data = StageInput(Laboratory(dataset.urdf, dataset.description))
    (after,) = _concluded(Context(data, replace(estimate, models=models, verdicts=(heavier,)))).models
    np.testing.assert_allclose([p.sigma for p in after.parameters], [4e-5, 0.1, 0.0])


def test_the_estimate_says_what_it_is(estimate):
    assert estimate.calibrated and estimate.main == "model_2"
    assert {"registration", "model_2"} <= {m.name for m in estimate.models}
    assert estimate.model("model_2").rank == 36
    assert estimate.model("registration").rank == 12
    assert {"clocks", "registration", "geometry"} <= {v.stage for v in estimate.verdicts}


def test_the_calibrated_robot_is_the_true_one_within_its_play(estimate, truth, chain):
    hand = hand_of(estimate.model("model_2"), chain, np.zeros(12))
    q = rigid_robot.near_postures(np.random.default_rng(9), 100)
    error = hand.poses(q + truth.offset)[:, :3, 3] - rigid_robot.hand_in_base(truth, q)[:, :3, 3]
    assert np.sqrt((error**2).mean()) < 1.5e-3  # 20 postures, each with up to 12 mrad of play in the wrist


def test_stages_can_be_chosen_and_bring_what_they_need(dataset, few):
    reported = []
    found = calibrate(dataset, ["registration"], lambda stage, share: reported.append((stage, share)))
    assert [m.name for m in found.models] == ["registration"] and found.main == "registration" and found.calibrated
    assert [s for s, _ in reported] == ["reading", "clocks", "postures", "registration", "done"]
    assert [x for _, x in reported] == sorted(x for _, x in reported)
    only = calibrate(load(few), ["clocks"])
    assert len(only.clocks) == 2 and only.status == "not_calibrated"


def test_an_unknown_stage_is_reported_with_those_that_exist(dataset):
    with pytest.raises(NoSuchElement, match=r"'magic'.*clocks.*geometry.*registration"):
        calibrate(dataset, ["magic"])


def test_without_a_plate_everything_else_works_and_it_is_said(few, tmp_path):
    changes = dict.fromkeys(FEW, rigid_robot.without_plate)
    estimate = calibrate(load(rewritten(few, tmp_path / "copy", changes)), ["geometry"])
    assert estimate.calibrated and [c.instrument for c in estimate.clocks] == ["robot"]
    assert any(v.verdict == "missing" and "plate" in v.message for v in estimate.verdicts)


def test_only_validation_trials_are_not_enough(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / "copy")
    listed = json.loads((copy / "dataset.json").read_text())
    listed["trials"] = [t for t in listed["trials"] if t["role"] == "validation"]
    (copy / "dataset.json").write_text(json.dumps(listed))
    with pytest.raises(InputError, match="no calibration trial"):
        calibrate(load(copy))


def test_without_static_postures_it_says_what_to_record(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / "copy")
    listed = json.loads((copy / "dataset.json").read_text())
    listed["trials"] = [t for t in listed["trials"] if t["id"] != "postures"]
    (copy / "dataset.json").write_text(json.dumps(listed))
    with pytest.raises(NotEnoughData, match="record a static trial"):
        calibrate(load(copy))


def test_markers_in_millimetres_are_refused_by_name(few, tmp_path):
    def in_mm(trial):
        return replace(trial, marker_position=1e3 * trial.marker_position)

    said = refused(rewritten(few, tmp_path / "copy", dict.fromkeys(FEW, in_mm)))
    assert "'gripper'" in said and "millimetres?" in said


def test_joints_in_degrees_are_refused_by_name(few, tmp_path):
    def in_degrees(trial):
        return replace(trial, q_motor=trial.q_motor * np.where(np.arange(8) > 0, 180.0 / np.pi, 1.0))

    said = refused(rewritten(few, tmp_path / "copy", dict.fromkeys(FEW, in_degrees)))
    assert "'arm_1_joint'" in said and "degrees?" in said and "torso" not in said


def test_three_postures_are_refused_and_nothing_is_exported(few, tmp_path):
    def three(trial):
        return replace(trial, dwell_start=trial.dwell_start[:3], dwell_stop=trial.dwell_stop[:3],
                       approach=trial.approach[:3])  # fmt: skip

    said = refused(rewritten(few, tmp_path / "copy", {"postures": three}), tmp_path / "out")
    assert "3 distinct postures" in said
    assert not (tmp_path / "out" / "calibrated.urdf").exists()


def test_a_truncated_recording_is_reported_by_file(folder, tmp_path):
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    path = copy / "trials" / "sweep1.nc"
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(InputError, match=r"sweep1\.nc.*sha256"):
        calibrate(load(copy))
    listed = json.loads((copy / "dataset.json").read_text())
    for entry in listed["trials"]:
        entry["sha256"] = sha256(copy / entry["file"])
    (copy / "dataset.json").write_text(json.dumps(listed))
    with pytest.raises(InputError, match=r"sweep1\.nc.*netCDF4"):
        calibrate(load(copy))


@pytest.mark.parametrize(
    "damage, said",
    [
        (lambda d: (d / "dataset.json").write_text('{"schema": 1,\n"robot" }'), r"dataset\.json:2:9: broken JSON"),
        (lambda d: (d / "dataset.json").unlink(), r"dataset\.json: no such file"),
        (lambda d: (d / "nominal.urdf").write_text("<robot>"), "not a URDF"),
        (lambda d: (d / "trials" / "xyz.nc").unlink(), r"missing.*xyz\.nc"),
    ],
)
def test_a_damaged_dataset_is_reported_with_its_place(folder, tmp_path, damage, said):
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    damage(copy)
    with pytest.raises(InputError, match=said):
        load(copy)


def test_all_findings_of_dataset_json_come_at_once(folder, tmp_path):
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    listed = json.loads((copy / "dataset.json").read_text())
    listed["sigmas"]["marker"] = -1.0
    listed["tolerances"]["speed"] = 1.0
    del listed["tool_frame"]
    (copy / "dataset.json").write_text(json.dumps(listed))
    with pytest.raises(InputError, match=r"(?s)tool_frame.*sigmas\.marker.*tolerances\.speed"):
        load(copy)
