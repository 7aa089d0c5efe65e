import json
from dataclasses import replace

import numpy as np
import pytest

from scenarios import load
from scenarios.files.errors import ScenarioError
from twin import truth
from twin.campaign import laboratory
from twin.motions import CALIBRATION_SWINGS, motion
from twin.simulation import simulate


@pytest.fixture(scope="module")
def anchored():
    return laboratory(load("humanoids2024", ["twin.base.wheels=anchored"]).quick().twin, 0)


def swing(config, name="around_z", duration=3.0):
    path = CALIBRATION_SWINGS[name]
    return motion.swing(name, "calibration", "swing", path, duration, config.campaign)


def test_an_anchored_base_comes_back_to_where_it_stood(anchored, config):
    campaign = replace(config.campaign, rest=4.0)
    there_and_back = motion.swing("z", "calibration", "swing", CALIBRATION_SWINGS["around_z"], 5.12, campaign)
    states = simulate(anchored.twin, there_and_back, anchored.T_lab_base)
    T = np.linalg.solve(states.poses["base_footprint"][500], states.poses["base_footprint"])
    moved, left = np.abs(T[:, :3, 3]).max(), np.abs(T[-1, :3, 3]).max()
    assert moved > 2e-4
    assert left < 0.02 * moved


def test_an_anchored_base_presses_on_the_plate_with_its_weight(anchored, config):
    states = simulate(anchored.twin, swing(config), anchored.T_lab_base)
    weight = 9.81 * anchored.twin.model.body_mass.sum()
    still = states.t < 1.0
    np.testing.assert_allclose(states.wrench[still, 2].mean(), -weight, rtol=1e-4)
    np.testing.assert_allclose(states.wrench[still, :2].mean(axis=0), 0.0, atol=0.1)


def test_infinite_stiffness_is_null_in_a_file(tmp_path):
    truth.write_parameters(tmp_path / "truth.json", [], {"K": np.diag([np.inf, 2.0])})
    assert json.loads((tmp_path / "truth.json").read_text())["derived"]["K"] == [[None, 0.0], [0.0, 2.0]]


def test_guides_rub_along_the_vertical_and_are_in_the_truth():
    lab = laboratory(load("humanoids2024", ["twin.base.drive.guide_friction=7.0"]).twin, 0)
    true = {p.name: p.value for p in lab.twin.truth}
    for wheel in lab.robot.wheels:
        found = [lab.twin.model.joint(f"{wheel.name}.{a}").frictionloss[0] for a in "xyz"]
        rubs = wheel.name.startswith("wheel")
        assert found == [0.0, 0.0, 7.0 if rubs else 0.0]
        assert true.get(f"suspension.{wheel.name}.guide_friction") == (7.0 if rubs else None)


@pytest.mark.parametrize("ground", ["anchored", "rigid"])
def test_wheels_without_guides_have_no_friction_in_them(ground):
    with pytest.raises(ScenarioError, match="guide_friction needs wheels: contact"):
        load("humanoids2024", [f"twin.base.wheels={ground}", "twin.base.caster_back.guide_friction=7.0"])


@pytest.mark.parametrize(
    ("setting", "reported"),
    [
        ("caster_back.contact_damping=0", "contact_damping: must be greater than 0"),
        ("drive.torsion_damping=[0, 0, 1]", "needs torsional stiffness about the same axis"),
    ],
)
def test_what_a_step_cannot_do_without_is_asked_for(setting, reported):
    with pytest.raises(ScenarioError, match=reported):
        load("humanoids2024", [f"twin.base.{setting}"])
