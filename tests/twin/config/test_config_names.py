"""Names in a scenario are those of the robot and its laboratory; others are refused where they stand."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import mjcf
from scenarios import steps
from scenarios.files.errors import ScenarioError
from twin.fields.names import ARM, TORSO, links
from twin.motions import JOINTS
from twin.random_streams import generator

BEND = "{stiffness: 3.0e+4, damping: 30.0}"
WARM = "{xi: [1.0e-4, 0.0, 0.0, 0.0, 0.0, 0.0], time_constant: 900.0}"
CABLE = "{stiffness: 0.5, rest: 0.0}"
HELD = "{holding: 0.4, slip: 3.0, stiffness: 9000.0}"
ARM_LINKS = "(known here: arm_1_link, arm_2_link, arm_3_link, arm_4_link, arm_5_link, arm_6_link, arm_7_link)"


def refused(folder: Path, *values: str) -> list[str]:
    """Lines that refuse the default scenario with these values, without the folder."""
    text = "name: mine\ndescription: Mine\nextends: humanoids2024\nset:\n" + "".join(f"  {line}\n" for line in values)
    (folder / "mine.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError) as info:
        steps.load(folder / "mine.yaml")
    return str(info.value).replace(f"{folder}/", "").splitlines()


def test_the_names_are_those_of_the_nominal_robot():
    model = mjcf.model()
    assert (TORSO, *ARM) == JOINTS
    for name in JOINTS:
        model.joint(name)
    assert {model.body(i).name for i in range(model.nbody)} - set(links()) == {"world", "plate"}
    assert set(links()) == {link.get("name") for link in ElementTree.fromstring(mjcf.urdf()).iter("link")}


@pytest.mark.parametrize(
    ("where", "value", "finding"),
    [
        ("departures.bending.arm_3_lnk", BEND, "no link of the arm named arm_3_lnk; did you mean arm_3_link?"),
        ("departures.bending.torso_lift_link", BEND, f"no link of the arm named torso_lift_link {ARM_LINKS}"),
        ("departures.bending.base_footprint", BEND, f"no link of the arm named base_footprint {ARM_LINKS}"),
        ("departures.warming.arm_2_jint", WARM, "no joint of torso or arm named arm_2_jint; did you mean arm_2_joint?"),
        ("departures.cables.head_1_joint", CABLE, "no arm joint named head_1_joint"),
        ("departures.cables.torso_lift_joint", CABLE, "no arm joint named torso_lift_joint"),
        ("departures.loosened.griper2", "{sag: 1.0e-3}", "no marker named griper2; did you mean gripper2?"),
        ("friction_held.arm_8_joint", HELD, "no arm joint named arm_8_joint"),
        ("instruments.bodies.base.link", "nosuch_link", "no link named nosuch_link; did you mean base_link?"),
    ],
)
def test_an_unknown_name_is_reported_where_it_stands_with_the_known_ones(tmp_path, where, value, finding):
    (line,) = refused(tmp_path, f"twin.{where}: {value}")
    column = 3 if value.startswith("{") else len(f"  twin.{where}: ") + 1
    assert line.startswith(f"mine.yaml:5:{column}: twin.{where}: {finding}") and "(known here: " in line


def test_unknown_names_are_reported_at_once_within_their_mapping(tmp_path):
    lines = refused(tmp_path, "twin.departures:", f"  bending: {{arm_8_link: {BEND}}}", f"  cables: {{arm_8: {CABLE}}}")
    assert [line.split(": ")[0] for line in lines] == ["mine.yaml:6:15", "mine.yaml:7:14"]


def test_an_unknown_joint_of_the_arm_is_refused(tmp_path):
    lines = refused(tmp_path, "twin.arm.arm_8_joint: {}")
    assert lines[0].startswith("mine.yaml:5:3: twin.arm.arm_8_joint: no arm joint named arm_8_joint")


def test_a_markers_name_is_its_own(tmp_path):
    markers = ("  base1: [0.0, 0.0, 0.1]", "  other: [0.0, 0.1, 0.1]")
    (line,) = refused(tmp_path, "twin.instruments.bodies.gripper.markers:", *markers)
    assert line.startswith("mine.yaml:6:5: twin.instruments.bodies.gripper.markers.base1: body base has a marker of")


def test_a_body_without_markers_is_refused(tmp_path):
    (line,) = refused(tmp_path, "twin.instruments.bodies.gripper.markers: {}")
    assert line.startswith("mine.yaml:5:44: twin.instruments.bodies.gripper.markers: ") and "at least 1" in line


def test_friction_that_nothing_holds_is_refused(tmp_path):
    (line,) = refused(tmp_path, f"twin.friction_held: {{arm_6_joint: {HELD}}}")
    assert line.startswith("mine.yaml:5:23: twin.friction_held: gear_form dead_zone has no friction_held; ")


@pytest.mark.parametrize("markers", [{"m": (0.01, 0.02, 0.1)}, {"m": (0.01, 0.0, 0.1), "n": (0.01, 0.0, 0.1)}])
def test_a_body_whose_markers_tell_no_rotation_is_mounted(markers):
    """What one marker is off is where its body is; two of one nominal place are off against each other alone."""
    body = replace(steps.load("humanoids2024").twin.instruments.bodies["gripper"], markers=markers, marker=1e-3)
    mounted = body.mounted("gripper", generator(0, "cluster", "gripper"))
    np.testing.assert_allclose(mounted.shift.sum(axis=0), 0.0, atol=1e-15)
    assert (np.abs(mounted.shift).max() > 1e-4) == (len(markers) > 1)
