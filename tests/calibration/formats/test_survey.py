"""A mapping drafted from files: what is in them, and what is left to choose."""

from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration.errors import InputErrors
from calibration.formats.mapping.channels import Joints, Markers, Recorded
from calibration.formats.mapping.short_form import TYPICAL, written_out
from calibration.formats.survey.bodies import FoundBody, found_bodies
from calibration.formats.survey.csv_view import view_csv
from calibration.formats.survey.draft import CHOOSE, draft
from calibration.formats.survey.plate_signs import reversed_force
from calibration.formats.survey.robot import read_urdf
from calibration.formats.survey.session import session_of
from calibration.formats.survey.trials import kind_of, suffixes
from calibration.formats.survey.view import FileView
from calibration.formats.survey.wrist_sign import convention_of
from calibration.robot.chain import chain_of_frames
from scenarios.files.errors import ScenarioError
from scenarios.steps import import_export
from tests.calibration.formats.test_bag import trial, write_bag
from tests.calibration.formats.test_csv import postures, series, write_csv
from tests.doubles.real_postures import ROOT

ROBOT = read_urdf(mjcf.urdf())


def test_the_robot_is_read_from_its_urdf():
    measured = ("torso_lift_joint", *(f"arm_{i}_joint" for i in range(1, 8)))
    assert ROBOT.root == "base_footprint" and ROBOT.tool(measured) == "gripper_grasping_frame"
    assert ROBOT.in_order(reversed(measured)) == list(measured)
    assert ROBOT.prismatic(measured) == ["torso_lift_joint"]


@pytest.mark.parametrize(("marker", "angle", "length"), [("m", "rad", "m"), ("mm", "deg", "mm")])
def test_units_are_read_from_sizes(tmp_path, marker, angle, length):
    columns = postures(14)
    scale = {"m": 1.0, "mm": 1e3, "rad": 1.0, "deg": np.degrees(1.0)}
    for name in columns:
        unit = marker if "gripper" in name else length if name.startswith("torso") else angle
        columns[name] = columns[name] * scale[unit]
    view = view_csv(write_csv(tmp_path / "p.csv", columns), ROBOT)
    text = "\n".join(view.layout)
    assert f"unit: [{angle}, {length}]" in text and ("marker_unit: mm" in text) == (marker == "mm")
    assert view.recorded.means.markers == ("gripper0", "gripper1", "gripper2", "gripper3")
    np.testing.assert_allclose(view.recorded.means.q, np.stack(list(postures(14).values())[:8], axis=1), atol=1e-9)


def test_axes_before_and_behind_the_name_are_markers(tmp_path):
    columns = {f"{a}{k}": np.linspace(0.1 * k, 1.0, 9) for k in (1, 2, 3) for a in "xyz"}
    joints = {j: np.linspace(0.0, 0.1, 9) for j in ROBOT.movable if j.startswith("arm")}
    view = view_csv(write_csv(tmp_path / "p.csv", columns | joints), ROBOT)
    assert view.layout[0] == 'markers: "{axis}{marker}"' and view.recorded.means.markers == ("1", "2", "3")


def test_a_plate_shows_its_centre_by_its_pressure(tmp_path):
    columns = {{"Cx": "COPx", "Cy": "COPy", "Cz": "COPz"}.get(k, k): v for k, v in series().items()}
    (plate,) = view_csv(write_csv(tmp_path / "log.csv", columns), ROBOT).plates
    np.testing.assert_allclose(plate.centre, 0.0, atol=1e-6)
    assert plate.convention == "action" and "moment_unit: N.m" in plate.layout


def test_a_wrist_sensor_beside_the_joints_is_drafted_and_asks_whose_wrench_it_is(tmp_path):
    t, urdf = np.arange(40) * 0.01, mjcf.urdf()
    joints = {j: np.sin(t + k) for k, j in enumerate(j for j in ROBOT.movable if j.startswith("arm"))}
    wrench = {f"wrist_{c}": np.cos(t) for c in ("Fx", "Fy", "Fz", "Mx", "My", "Mz")}
    for name, robot in (("wrist_ft_link", urdf), ("gripper_grasping_frame", urdf.replace("wrist_ft", "adapter"))):
        path = write_csv(tmp_path / "log.csv", {"t": t} | joints | wrench)
        session = session_of([path], robot)
        text = draft(session, "robot.urdf", ["log.csv"])
        assert "wrist: {force: [wrist_Fx, wrist_Fy, wrist_Fz], moment: [wrist_Mx, wrist_My, wrist_Mz]" in text
        assert f"wrist_link: {name}" in text and text.count("whose wrench") == 1 and not session.views[0].plates


@pytest.mark.parametrize(("sign", "found"), [(1.0, "action"), (-1.0, "reaction"), (0.0, "")])
def test_the_weight_below_a_wrist_sensor_shows_whose_wrench_it_stores(sign, found):
    rng, urdf = np.random.default_rng(0), mjcf.urdf()
    names = tuple(j for j in ROBOT.movable if j.startswith("arm"))
    q = rng.uniform(-1.0, 1.0, (100, len(names)))
    T = chain_of_frames(urdf, names, ROBOT.root, "wrist_ft_link").poses(q, "wrist_ft_link")
    wrench = np.hstack([-8.0 * sign * T[:, 2, :3] + [3.0, -40.0, 5.0], np.zeros((100, 3))]) + rng.normal(size=(100, 6))
    none = np.full(q.shape, np.nan)
    joints = Joints(np.arange(100.0), names, q, none, none, none, none, wrench)
    assert convention_of([Recorded("x", joints=joints)], urdf, ROBOT.root, "wrist_ft_link") == found


@pytest.mark.parametrize("ros", [1, 2])
def test_a_wrist_sensor_in_a_bag_is_drafted_by_its_topic(tmp_path, ros):
    path = tmp_path / ("log.bag" if ros == 1 else "log")
    write_bag(path, trial(), ros)
    text = draft(session_of([path], mjcf.urdf()), "robot.urdf", [path.name])
    assert "wrist: /wrist_ft\n" in text and "wrist_link: wrist_ft_link  # CHOOSE" in text
    assert "wrist_convention: action  # CHOOSE: whose wrench" in text


def test_a_log_of_one_file_asks_for_one_line(tmp_path):
    log = ROOT / "tests/data/vicon_forceplate_2023-09-20.csv"
    text = import_export.init_mapping([log], tmp_path / "lab.yaml")
    assert [line.split()[2] for line in text.splitlines() if "CHOOSE" in line.split("#")[0]] == ["base,"]
    assert "reversed: [Fy]" in text and text.count("part: [") == 2
    (tmp_path / "lab.yaml").write_text(text.replace("heading: CHOOSE", "heading: -1.614"))
    described = import_export.read_mapping(tmp_path / "lab.yaml")
    assert [t.part for t in described.trials] == [(0.0, 21.6), (21.6, 33.7)]


def test_only_a_force_against_the_motion_of_the_hand_is_reversed():
    view = view_csv(ROOT / "tests/data/vicon_forceplate_2023-09-20.csv", ROBOT)
    (plate,), hand = view.plates, FoundBody("gripper", ("gripper1", "gripper2", "gripper3"), 1.0)
    right = replace(plate, wrench=plate.wrench * [1.0, -1.0, 1.0, 1.0, 1.0, 1.0])
    reaction = replace(right, wrench=-right.wrench)
    found = [reversed_force(p, view.recorded.markers, hand) for p in (plate, right, reaction)]
    assert found == ["Fy", "", ""]
    assert reversed_force(plate, view.recorded.markers, replace(hand, markers=("base1", "base2", "base3"))) == ""


def test_labels_are_grouped_by_rigid_distances():
    rng = np.random.default_rng(0)
    base = rng.uniform(-0.3, 0.3, (3, 3)) + np.zeros((50, 3, 3))
    hand = rng.uniform(-0.1, 0.1, (4, 3)) + np.linspace(0.0, 0.5, 50)[:, None, None]
    stray = rng.uniform(-1.0, 1.0, (50, 1, 3))
    names = ("A1", "A2", "A3", "w1", "w2", "w3", "w4", "ghost")
    p = np.concatenate([base, hand, stray], axis=1) + 1e-4 * rng.normal(size=(50, 8, 3))
    bodies, alone = found_bodies([Recorded("x", Markers(np.arange(50.0), names, p))])
    assert [b.name for b in bodies] == ["A", "w"] and alone == ("ghost",)


def test_files_of_one_trial_share_what_is_before_their_ends(tmp_path):
    kinds = {"_mocap.csv": ("markers",), "_robot.csv": ("joints",)}
    views = [
        FileView(tmp_path / f"{t}{end}", "csv", Recorded(t), (), layout)
        for t in ("day_1", "day_2")
        for end, layout in kinds.items()
    ]
    assert set(suffixes(views).values()) == set(kinds)
    assert suffixes(views[:2]) == {"day_1_mocap.csv": "_mocap.csv", "day_1_robot.csv": "_robot.csv"}


@pytest.mark.parametrize(("angles", "kind"), [((0.4, 0.4, 0.4, 0.4), "swing"), ((0.4, 0.9, 1.4, 0.1), "static")])
def test_a_swing_that_halts_where_it_began_is_no_tour_of_postures(angles, kind):
    t = np.arange(0.0, 20.0, 0.01)
    q = np.zeros((len(t), 2))
    for k, angle in enumerate(angles):
        inside = (t >= 5.0 * k) & (t < 5.0 * (k + 1))
        s, before = t[inside] - 5.0 * k, angles[max(k - 1, 0)]
        moving = np.sin(np.pi * s / 3.0) ** 2 * 0.3 + before + (angle - before) * np.clip(s / 3.0, 0.0, 1.0)
        q[inside] = np.where(s < 3.0, moving, angle)[:, None]
    none = np.full((len(t), 2), np.nan)
    joints = Joints(t, ("a", "b"), q, none, none, none, none)
    assert kind_of(Recorded("a.csv", joints=joints), []) == kind


def test_a_draft_imports_as_it_is_and_asks_what_no_file_says(tmp_path):
    file = write_csv(tmp_path / "postures.csv", postures(20))
    text = import_export.init_mapping([file], tmp_path / "lab.yaml")
    lines = text.splitlines()
    assert len(lines) <= 25 and sum(CHOOSE in line for line in lines) == 2
    import_export.import_files(None, (), tmp_path / "lab.yaml", tmp_path / "dataset")
    with pytest.raises(ScenarioError, match="exists"):
        import_export.init_mapping([file], tmp_path / "lab.yaml")


def test_all_files_that_cannot_be_read_are_named_together(tmp_path):
    bad = [tmp_path / "a.csv", tmp_path / "b.c3d"]
    bad[0].write_text("hello,world\n1,2\n")
    bad[1].write_bytes(b"nothing")
    with pytest.raises(InputErrors) as info:
        session_of(bad, mjcf.urdf())
    assert all(str(path) in str(info.value) for path in bad)


def test_everything_missing_and_everything_open_is_said_in_one_round(tmp_path):
    (tmp_path / "lab.yaml").write_text(
        "urdf: tiago\n"
        "bodies: [{name: base, link: base_footprint, undrawn: [a], standing: {x: 0, y: 0, heading: CHOOSE}}]\n"
        "trials: {static: [s]}\nvalidation: [elsewhere]\n"
    )
    with pytest.raises(ScenarioError) as info:
        import_export.read_mapping(tmp_path / "lab.yaml")
    said = str(info.value)
    for what in ("setup.robot: missing", "setup.joints: missing", "setup.sigmas: missing", "heading", "trials.1.kind"):
        assert what in said


def test_short_forms_are_written_out():
    joints = {"names": ["a", "b"], "prismatic": ["a"], "link_encoders": ["b"], "rate": 50.0}
    table = {"markers": "{axis}{marker}", "joints": {"motor": "{joint}_q", "link": "{joint}_l", "unit": ["deg", "mm"]}}
    found = written_out(
        {
            "setup": {"joints": joints},
            "bodies": [{"name": "hand", "undrawn": ["1", "2"]}],
            "trials": {"static": ["s"], "swing": ["u", "v"]},
            "validation": ["v"],
            "csv": [table],
            "bag": {"joints": "same"},
        }
    )
    assert found["setup"]["joints"][1] == {"name": "b", "encoders": ["motor", "link"], "rate": 50.0}
    assert found["setup"]["tolerances"] == TYPICAL
    assert [t["role"] for t in found["trials"]] == ["calibration", "calibration", "validation"]
    assert found["csv"][0]["markers"]["2"] == ["x2", "y2", "z2"]
    assert found["csv"][0]["joints"]["a"] == {"motor": "a_q", "unit": "mm"}
    assert found["csv"][0]["joints"]["b"] == {"motor": "b_q", "link": "b_l", "unit": "deg"}
    assert found["bag"]["joints"] == {"a": "a", "b": "b"}


def test_a_draft_is_the_same_for_the_same_files(tmp_path):
    file = write_csv(tmp_path / "postures.csv", postures(14))
    session = session_of([file], mjcf.urdf())
    assert draft(session, "tiago", ["postures.csv"]) == draft(session, "tiago", ["postures.csv"])
