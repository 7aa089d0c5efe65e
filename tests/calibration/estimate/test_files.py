import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import yaml

import mjcf
from calibration import Compensator, load_estimate, save_estimate
from calibration.errors import InputError, NotCalibrated, ShapeError
from calibration.estimate.tables import read_parameters, read_zeros, zeros_text
from calibration.robot.chain import chain_of
from calibration.robot.hand import nominal_hand
from calibration.robot.urdf import calibrated_urdf, roll_pitch_yaw
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.verdict import Verdict
from tests.doubles import rigid_robot
from tests.doubles.rigid_robot import with_values


def all_bytes(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in sorted(folder.iterdir())}


def test_the_exported_urdf_is_the_estimate_to_1e_9_on_1000_configurations(estimate, chain, tmp_path):
    save_estimate(estimate, tmp_path)
    hand = hand_of(estimate.model("model_2"), chain, np.zeros(12))
    exported = chain_of((tmp_path / "calibrated.urdf").read_text(), rigid_robot.described())
    q = rigid_robot.random_angles(np.random.default_rng(0), 1000)
    np.testing.assert_allclose(exported.poses(hand.angles(q)), hand.chain.poses(hand.angles(q)), atol=1e-9, rtol=0)
    assert np.abs(exported.poses(q) - chain.poses(q)).max() > 1e-3


def test_a_urdf_is_of_the_geometry_of_bare_motor_readings_where_drive_trains_are_known(estimate):
    assert estimate.exported == estimate.main == "model_2"
    assert replace(estimate, main="full").exported == "full"  # of posture means
    assert replace(estimate, main="full", bundle=object()).exported == "model_2"


def test_zeros_read_back_close_the_loop(estimate, chain, tmp_path):
    save_estimate(estimate, tmp_path)
    zeros = read_zeros(tmp_path / "zeros.yaml")
    assert [z.joint for z in zeros] == list(chain.joints)
    exported = chain_of((tmp_path / "calibrated.urdf").read_text(), rigid_robot.described())
    readings = rigid_robot.random_angles(np.random.default_rng(0), 20)
    angles = readings - np.array([z.offset for z in zeros])  # the sign the file states
    hand = hand_of(estimate.model("model_2"), chain, np.zeros(12))
    np.testing.assert_allclose(exported.poses(angles), hand.in_base_frame(readings) @ inverse_of_hand(hand), atol=1e-9)


def test_zeros_of_an_elastic_robot_carry_its_compliance(chain, tmp_path):
    elastic = with_values(
        nominal_hand(chain, np.zeros(12)), offset=0.01 * np.arange(8.0), compliance=1e-4 * np.arange(8.0)
    )
    (tmp_path / "zeros.yaml").write_text(zeros_text(elastic))
    zeros = read_zeros(tmp_path / "zeros.yaml")
    q = rigid_robot.random_angles(np.random.default_rng(0), 5)
    angles = q - [z.offset for z in zeros] - np.array([z.compliance for z in zeros]) * chain.gravity_torques(q)
    np.testing.assert_allclose(angles, elastic.angles(q), atol=1e-15)


def test_what_pals_publisher_adds_to_the_origins_is_the_same_robot(estimate, chain, tmp_path):
    save_estimate(estimate, tmp_path)
    added = yaml.safe_load((tmp_path / "master_calibration.yaml").read_text())
    added = added["robot_state_publisher"]["geometric_calibration"]
    assert len(added) > 40 and {k.rpartition("_")[2] for k in added} == set("dx dy dz droll dpitch dyaw".split())
    robot = ET.fromstring(mjcf.urdf())
    for key, value in added.items():
        name, _, what = key.rpartition("_")
        origin = next(j for j in robot.findall("joint") if j.get("name") == f"{name}_joint").find("origin")
        kind, k = ("xyz", "xyz".find(what[1:])) if len(what) == 2 else ("rpy", "rpy".find(what[1]))
        numbers = [float(x) for x in origin.get(kind, "0 0 0").split()]
        origin.set(kind, " ".join(repr(x + value * (i == k)) for i, x in enumerate(numbers)))
    published = chain_of(ET.tostring(robot, encoding="unicode"), rigid_robot.described())
    readings = rigid_robot.random_angles(np.random.default_rng(0), 50)
    hand = hand_of(estimate.model("model_2"), chain, np.zeros(12))
    np.testing.assert_allclose(
        published.poses(readings), hand.in_base_frame(readings) @ inverse_of_hand(hand), atol=1e-9
    )


def test_another_reader_of_urdf_finds_every_link_of_the_calibrated_robot_where_ours_does(estimate, tmp_path):
    save_estimate(estimate, tmp_path)
    text = (tmp_path / "calibrated.urdf").read_text()
    whole = '<mujoco><compiler fusestatic="false"/></mujoco></robot>'
    model = mujoco.MjModel.from_xml_string(text.replace("</robot>", whole))
    data, ours = mujoco.MjData(model), chain_of(text, rigid_robot.described())
    q = rigid_robot.random_angles(np.random.default_rng(0), 5)
    links = [f"arm_{k}_link" for k in range(1, 8)]
    for readings in q:
        for name, value in zip(rigid_robot.JOINTS, readings, strict=True):
            data.joint(name).qpos = value
        mujoco.mj_kinematics(model, data)
        for link in links:
            (T,) = ours.poses(readings[None], link)
            np.testing.assert_allclose(data.body(link).xpos, T[:3, 3], atol=1e-9)
            np.testing.assert_allclose(data.body(link).xmat.reshape(3, 3), T[:3, :3], atol=1e-9)
    assert {j.get("type") for j in ET.fromstring(text).findall("joint")} <= set(
        "revolute continuous prismatic fixed".split()
    )


@pytest.mark.parametrize("text", ["- joint: a\n  offset: none", "- [1, 2", "- joint: a\n  ofset: 1.0", "3"])
def test_zeros_that_are_none_are_reported(tmp_path, text):
    (tmp_path / "zeros.yaml").write_text(text)
    with pytest.raises(InputError):
        read_zeros(tmp_path / "zeros.yaml")


def test_the_table_of_parameters_reads_back_as_the_estimate(estimate, tmp_path):
    save_estimate(estimate, tmp_path)
    rows = read_parameters(tmp_path / "parameters.csv")
    assert [(r.model, r.name, r.value, r.sigma, r.unit, r.status, r.nominal) for r in rows] == [
        (m.name, p.name, p.value, p.sigma, p.unit, p.status, p.nominal) for m in estimate.models for p in m.parameters
    ]
    lines = (tmp_path / "parameters.csv").read_text().splitlines()
    assert lines[0].startswith("name,value,sigma,unit,status")
    lines[3] = lines[3].replace(",", ",x", 1)
    (tmp_path / "broken.csv").write_text("\n".join(lines))
    with pytest.raises(InputError, match="line 4, value"):
        read_parameters(tmp_path / "broken.csv")


def inverse_of_hand(hand):
    return np.linalg.inv(rigid_robot.se3(hand.hand))


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-9, -np.pi / 2 + 1e-5, 0.3])
def test_roll_pitch_yaw_is_exact_at_gimbal_lock(pitch):
    rng = np.random.default_rng(0)
    for k, (roll, yaw) in enumerate(rng.uniform(-np.pi, np.pi, size=(200, 2))):
        R = pin.rpy.rpyToMatrix(roll, pitch, yaw) @ pin.exp3((0.0, 1e-12, 1e-8, 1e-4)[k % 4] * rng.normal(size=3))
        np.testing.assert_allclose(pin.rpy.rpyToMatrix(roll_pitch_yaw(R)), R, atol=2e-15)


def test_what_is_not_a_joint_of_the_chain_stays_as_it_was(chain):
    text = mjcf.urdf().replace("<robot", "<!-- kept --><robot", 1)
    text = text.replace("</robot>", "<!-- also kept --></robot>")
    moved = calibrated_urdf(text, chain.with_placements(0.01 * np.ones(chain.xi.shape)))
    a, b = (pin.buildModelFromXML(t) for t in (text, moved))
    for name in a.names:
        same = a.jointPlacements[a.getJointId(name)].isApprox(b.jointPlacements[b.getJointId(name)], 0.0)
        assert same != (name in chain.joints)
    assert "also kept" in moved


def test_saving_and_loading_gives_the_same_estimate_and_the_same_bytes(estimate, tmp_path):
    save_estimate(estimate, tmp_path / "one")
    back = load_estimate(tmp_path / "one")
    save_estimate(back, tmp_path / "two")
    save_estimate(estimate, tmp_path / "three")
    assert all_bytes(tmp_path / "one") == all_bytes(tmp_path / "two") == all_bytes(tmp_path / "three")
    assert back.model("model_2").parameters == estimate.model("model_2").parameters
    np.testing.assert_array_equal(back.model("model_2").covariance, estimate.model("model_2").covariance)


def test_estimate_json_has_the_fields_of_the_contract(estimate, tmp_path):
    save_estimate(estimate, tmp_path)
    found = json.loads((tmp_path / "estimate.json").read_text())
    assert {"schema", "status", "verdicts", "models", "main"} <= set(found)
    assert found["main"] == "model_2"
    names = [p["name"] for p in found["models"]["model_2"]["parameters"]]
    for name in ("geometry.arm_3_joint.rx", "encoder.arm_5_joint.motor.offset", "frame.base.base.x",
                 "frame.tool.hand.rz", "clock.robot.offset", "clock.plate.drift"):  # fmt: skip
        assert name in names
    assert set(found["models"]["model_2"]["combinations"][0]) == {"name", "coefficients", "value", "sigma"}


def test_a_combination_is_its_coefficients_times_the_values(estimate):
    model = estimate.model("model_2")
    values = np.array([p.value for p in model.parameters])
    for c in model.combinations:
        assert c.value == pytest.approx(c.coefficients @ values, abs=1e-15)
        assert c.sigma == pytest.approx(np.sqrt(c.coefficients @ model.covariance @ c.coefficients))


def test_an_estimate_that_must_not_be_used_exports_nothing_and_cannot_be_loaded_for_use(estimate, tmp_path):
    save_estimate(estimate, tmp_path)
    bad = replace(estimate, status="not_calibrated", verdicts=(Verdict("geometry", "refused", "too few postures"),))
    save_estimate(bad, tmp_path)
    assert not {"calibrated.urdf", "zeros.yaml", "master_calibration.yaml"} & {p.name for p in tmp_path.iterdir()}
    with pytest.raises(NotCalibrated, match="too few postures"):
        Compensator.load(tmp_path)


def test_an_estimate_of_another_program_needs_names_and_values_only(tmp_path, chain):
    parameters = [{"name": "geometry.arm_1_joint.x", "value": 0.01}, {"name": "their.own", "value": 3.0}]
    other = {"schema": 1, "status": "calibrated", "verdicts": [], "models": {"model_2": {"parameters": parameters}}}
    (tmp_path / "estimate.json").write_text(json.dumps(other | {"main": "model_2", "by": "others"}))
    model = load_estimate(tmp_path / "estimate.json").model("model_2")
    hand = hand_of(model, chain, np.zeros(12))
    assert hand.chain.xi[1, 0] == 0.01 and np.count_nonzero(hand.theta) == 1


def test_a_bare_urdf_is_an_estimate(estimate, tmp_path, chain):
    save_estimate(estimate, tmp_path)
    found = load_estimate(tmp_path / "calibrated.urdf")
    hand = hand_of(found.model(found.main), chain_of(str(found.urdf), rigid_robot.described()), np.zeros(12))
    mine = hand_of(estimate.model("model_2"), chain, np.zeros(12))
    q = rigid_robot.random_angles(np.random.default_rng(0), 10)
    np.testing.assert_allclose(hand.chain.poses(q), mine.chain.poses(q), atol=1e-12)


@pytest.mark.parametrize(
    "name, text, said",
    [
        ("estimate.json", '{"schema": 1,\n "models": }', r":2:12: broken JSON"),
        ("estimate.json", '{"schema": 1, "models": {"a": {"parameters": [{"name": "x"}]}}}', "value: Field required"),
        ("estimate.json", '{"models": {"a": {"parameters": [{"name": "x", "value": NaN}]}}}', "finite"),
        ("nothing.json", None, "no such file"),
    ],
)
def test_a_damaged_estimate_is_reported_with_its_place(tmp_path, name, text, said):
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=said):
        load_estimate(tmp_path / name)


def test_the_compensator_predicts_the_calibrated_hand_with_its_covariance(estimate, truth, chain, tmp_path):
    save_estimate(estimate, tmp_path)
    compensator = Compensator.load(tmp_path)
    q = rigid_robot.near_postures(np.random.default_rng(7), 50)
    T_lab_base = rigid_robot.se3(np.array([1.0, 2.0, 0.0, 0.0, 0.0, 0.5]))
    found = compensator.predict(np.arange(50.0), q + truth.offset, T_lab_base_start=T_lab_base)
    hand = hand_of(estimate.model("model_2"), chain, np.zeros(12))
    np.testing.assert_allclose(found.T, T_lab_base @ hand.in_base_frame(q + truth.offset), atol=1e-12)
    one = compensator.step(3.0, q[3] + truth.offset, T_lab_base_start=T_lab_base)
    np.testing.assert_array_equal(one.T[0], found.T[3])
    in_markers = np.linalg.inv(rigid_robot.se3(hand.base)) @ hand.in_base_frame(q + truth.offset)
    error = [
        pin.log6(pin.SE3(a).actInv(pin.SE3(b))).vector
        for a, b in zip(rigid_robot.hand_in_base(truth, q), in_markers, strict=True)
    ]
    squared = [e @ np.linalg.solve(C, e) for e, C in zip(error, found.covariance, strict=True)]
    assert 0.2 < np.mean(squared) / 6.0 < 3.0  # no play in these postures, and one draw of the estimate


def test_readings_and_times_must_match(estimate):
    with pytest.raises(ShapeError, match="q_motor"):
        Compensator.of(estimate).predict(np.zeros(3), np.zeros((2, 8)))


def test_a_nominal_hand_has_the_marker_bodies_on_their_links(chain):
    assert not nominal_hand(chain, np.zeros(12)).theta.any()
