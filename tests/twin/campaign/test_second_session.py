"""The confirmation session: the same robot on another day."""

import json
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

from twin.campaign import laboratory, record, second_session
from twin.config import Departures
from twin.instruments import LooseMarker
from twin.motions import schedule
from twin.truth import read_trial


@pytest.fixture(scope="module")
def later(lab):
    return second_session(lab)


def test_there_is_no_second_session_unless_it_is_asked_for(config, nominal):
    assert not any(m.role == "confirmation" for m in schedule(config.campaign, nominal, 0))
    with_it = schedule(replace(config.campaign, confirmation=True), nominal, 0)
    assert [m.id for m in with_it if m.role == "confirmation"] == [
        "registration_confirmation",
        "xyz_confirmation",
        "xyz_mirror_confirmation",
        "postures_confirmation",
    ]
    before = schedule(config.campaign, nominal, 0)
    for a, b in zip(before, with_it, strict=False):
        np.testing.assert_array_equal(a.command, b.command)


@pytest.mark.parametrize(
    ("only", "confirmed"),
    [
        (("postures",), []),
        (("xyz",), ["registration_confirmation", "xyz_confirmation"]),
        (("postures", "postures_validation"), ["registration_confirmation", "postures_confirmation"]),
    ],
)
def test_a_second_session_repeats_the_validation_that_is_asked_for(config, nominal, only, confirmed):
    asked = replace(config.campaign, confirmation=True, only=only)
    assert [m.id for m in schedule(asked, nominal, 0) if m.role == "confirmation"] == confirmed


def test_the_truth_tells_of_no_session_that_is_not_recorded(config, tmp_path):
    asked = replace(config.campaign, confirmation=True, only=("postures",), carried=True)
    record(replace(config, campaign=asked), 0, tmp_path)
    content = json.loads((tmp_path / "truth/truth.json").read_text())
    names = [*content["derived"], *(p["name"] for p in content["parameters"])]
    assert not [n for n in names if n.startswith("confirmation")]


def test_a_loose_marker_is_tight_once_it_is_remounted(config):
    lab = laboratory(replace(config, departures=Departures(loosened={"gripper2": LooseMarker("gripper2", 1e-3)})), 0)
    assert lab.robot.loose and not second_session(lab).robot.loose


def test_the_robots_body_stays_and_what_is_mounted_on_it_changes(lab, later):
    assert later.twin is lab.twin and later.robot.defects is lab.robot.defects
    for first, second in zip(lab.robot.clusters, later.robot.clusters, strict=True):
        assert np.abs(first.xi - second.xi).max() > 1e-4
        assert np.abs(first.shift - second.shift).max() > 1e-5
        np.testing.assert_array_equal(first.nominal, second.nominal)
    step = np.linalg.solve(lab.T_lab_base, later.T_lab_base)
    assert 0.005 < np.abs(step[:2, 3]).max() < 0.12 and step[2, 3] == 0.0


def test_homing_again_has_the_width_it_is_given(config, lab):
    wide = replace(lab, config=replace(config, session=replace(config.session, encoder_zero=1e-3)))
    shifts = []
    for seed in range(60):
        pairs = zip(lab.robot.encoders, second_session(replace(wide, seed=seed)).robot.encoders, strict=True)
        for first, second in pairs:
            changed = second.offset - first.offset
            if first.side == "motor" and not first.prismatic:
                shifts.append(changed)
            else:
                assert changed == 0.0
    assert np.std(shifts) == pytest.approx(1e-3, rel=0.1)


def test_a_campaign_with_two_sessions_tells_their_truths_apart(config, tmp_path, monkeypatch):
    def only_xyz(*given, schedule=schedule):
        return tuple(m for m in schedule(*given) if m.name == "xyz")

    monkeypatch.setattr(import_module("twin.campaign.recording"), "schedule", only_xyz)
    short = replace(config.campaign, validation_swing=3.0, confirmation=True)
    record(replace(config, campaign=short), 0, tmp_path)
    description = json.loads((tmp_path / "dataset/dataset.json").read_text())
    roles = {t["id"]: (t["role"], t["motion"]) for t in description["trials"]}
    assert roles == {"xyz": ("validation", "xyz"), "xyz_confirmation": ("confirmation", "xyz")}
    base = {role: read_trial(tmp_path / f"truth/trials/{id}.nc").base_pose[0] for id, (role, _) in roles.items()}
    assert np.linalg.norm((base["validation"] - base["confirmation"])[:2, 3]) > 0.005
    content = json.loads((tmp_path / "truth/truth.json").read_text())
    truth = {p["name"]: p["value"] for p in content["parameters"]}
    for name in ("encoder.arm_1_joint.motor.offset", "frame.tool.hand.x", "marker.base1.z"):
        assert truth[name] != truth[f"confirmation.{name}"]
    assert not any(name.startswith("confirmation.geometry") for name in truth)
    derived = content["derived"]
    assert "confirmation.T_lab_base" in derived and np.shape(derived["K_gravity"]) == (6, 6)
    assert derived["K_gravity"][3][3] < 0.0 < min(derived["slip_load"])
