"""No order of names in a scenario's file changes the robot or its recordings."""

from dataclasses import fields

import mujoco
import numpy as np
import pytest
import yaml

from scenarios import load
from scenarios.files import yaml_file
from scenarios.files.errors import ScenarioError
from twin.campaign import laboratory, measure
from twin.motions import motion as motions

OVERRIDES = (
    "twin.coupled_wrist=true",
    "twin.gear_form=friction_held",
    "twin.widths.mount_translation=0.01",
    "twin.departures.cables={arm_3_joint: {stiffness: 1.0, rest: 0.0}, arm_5_joint: {stiffness: 2.0, rest: 0.1}}",
    "twin.departures.loosened={base1: {sag: 1.0e-3}, gripper2: {sag: 2.0e-3}}",
)


def reversed_names(values):
    """The same values with every mapping written the other way round."""
    if isinstance(values, dict):
        return {key: reversed_names(value) for key, value in reversed(values.items())}
    return [reversed_names(v) for v in values] if isinstance(values, list) else values


@pytest.fixture(scope="module")
def laboratories(tmp_path_factory):
    """One robot, from a file and from the same file with its names in the other order."""
    path = tmp_path_factory.mktemp("order") / "scenario.yaml"
    yaml_file.write(path, load("humanoids2024", OVERRIDES))
    written = laboratory(load(path).twin, 0)
    values = reversed_names(yaml.safe_load(path.read_text()))
    assert next(iter(values["twin"]["arm"])) == "arm_7_joint"
    path.write_text(yaml.safe_dump(values, sort_keys=False))
    return written, laboratory(load(path).twin, 0)


def test_the_robot_is_the_same(laboratories):
    one, other = laboratories
    assert one.twin.truth == other.twin.truth
    models = [np.zeros(mujoco.mj_sizeModel(lab.twin.model), np.uint8) for lab in laboratories]
    for model, lab in zip(models, laboratories, strict=True):
        mujoco.mj_saveModel(lab.twin.model, None, model)
    np.testing.assert_array_equal(*models)


def test_the_recording_is_the_same(laboratories):
    path = motions.sweep_path("arm_2_joint", 2.0)
    motion = motions.swing("sweep", "calibration", "sweep", path, 2.0, laboratories[0].config.campaign)
    one, other = (measure(lab, motion, lab.states(motion, 0.0), 100.0)[0] for lab in laboratories)
    for field in fields(one):
        np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name), field.name)


def test_an_arm_without_one_of_its_joints_is_reported(tmp_path):
    path = tmp_path / "scenario.yaml"
    yaml_file.write(path, load("humanoids2024"))
    values = yaml.safe_load(path.read_text())
    del values["twin"]["arm"]["arm_4_joint"]
    path.write_text(yaml.safe_dump(values))
    with pytest.raises(ScenarioError, match="twin.arm: .*there is no arm_4_joint"):
        load(path)
