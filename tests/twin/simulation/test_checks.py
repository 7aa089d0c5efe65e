from dataclasses import replace

import numpy as np
import pytest

from scenarios import load
from tests.doubles.grounds import GROUNDS
from twin import record
from twin.campaign import laboratory
from twin.defects.gear import mesh_tendon
from twin.defects.wheels.contact import ContactTooStiff
from twin.errors import BaseVibrates, Diverged, RobotFell
from twin.motions import motion
from twin.simulation import simulate
from twin.transforms import exp6


@pytest.fixture(scope="module")
def sweep(config):
    return motion.swing("s", "calibration", "sweep", motion.sweep_path("arm_7_joint", 2.0), 2.0, config.campaign)


def edited(twin, edit):
    model = twin.model.__copy__()
    edit(model)
    return replace(twin, model=model)


def lock_up(model):
    """Damping beyond what a step can hold: not finite at once."""
    model.actuator_biasprm[:, 2] = 1e7


def harden(model):
    """A mesh that the step cannot follow: MuJoCo resets it and goes on with finite numbers."""
    model.tendon_solref_lim[model.tendon(mesh_tendon("arm_7_joint")).id] *= 1e4


def feed(model):
    """A drive that pushes the way it moves."""
    model.actuator_biasprm[model.actuator("arm_4_joint.motor").id, 2] *= -1.0


@pytest.mark.parametrize(("edit", "joint"), [(lock_up, r"[\w.]+"), (harden, "arm_7_joint"), (feed, "arm_4_joint.*")])
def test_what_runs_away_is_named_with_trial_time_and_joint(lab, sweep, edit, joint, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(Diverged, match=rf"trial 's' diverged at -?\d+\.\d+ s in joint '{joint}'") as caught:
        simulate(edited(lab.twin, edit), sweep, lab.T_lab_base)
    assert -2.0 <= caught.value.time < sweep.duration
    assert not list(tmp_path.iterdir())  # no log of MuJoCo's


def test_a_campaign_that_runs_away_records_nothing(tmp_path):
    config = (
        load("humanoids2024", ["twin.arm.arm_7_joint.servo_stiffness=1e9", "twin.campaign.only=[xyz]"]).quick().twin
    )
    with pytest.raises(Diverged, match="'arm_7_joint"):
        record(config, 0, tmp_path)
    assert not [p for p in tmp_path.rglob("*") if p.is_file()]


def test_tipping_is_reported(lab, sweep):
    def soften(model):
        for wheel in lab.robot.wheels:
            model.jnt_stiffness[model.joint(f"{wheel.name}.z").id] = 200.0

    with pytest.raises(RobotFell, match=r"'s': the robot tips over at -?\d+\.\d\d s"):
        simulate(edited(lab.twin, soften), sweep, lab.T_lab_base)


@pytest.mark.parametrize("ground", ["contact", "anchored"])
def test_a_wheel_off_the_plate_is_reported(sweep, ground):
    lab = laboratory(load("humanoids2024", [f"twin.base.wheels={ground}"]).quick().twin, 0)
    beyond = exp6(np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0])) @ lab.T_lab_base
    with pytest.raises(RobotFell, match=r"'s': (caster|wheel)_\w+ is off the plate at -2\.00 s"):
        simulate(lab.twin, sweep, beyond)


def stands_and_sweeps(sweep, *settings):
    lab = laboratory(load("humanoids2024", settings).quick().twin, 4)
    simulate(lab.twin, sweep, lab.T_lab_base)


DAMPED = [f"twin.base.{w}.damping=[150.0, 150.0, 9e4]" for w in ("drive", "caster_front", "caster_back")]


@pytest.mark.parametrize(
    ("settings", "joint"),
    [
        (DAMPED, "root"),
        (["twin.torso.servo_stiffness=1e9"], "torso_lift_joint"),
        (["twin.base.caster_front.damping=[0.0, 0.0, 0.0]"], r"caster_front_\w+\.z"),
    ],
)
def test_a_base_that_vibrates_at_rest_is_refused(sweep, settings, joint):
    with pytest.raises(BaseVibrates, match=rf"trial 's': the base vibrates .* most of all joint '{joint}'"):
        stands_and_sweeps(sweep, *settings)


RIGID = {
    "damped alike": [f"twin.base.{w}.contact_damping=1000.0" for w in ("drive", "caster_front", "caster_back")],
    "damped by drives": ["twin.base.drive.contact_damping=1500.0"],
    "smooth": ["twin.base.caster_front.friction=0.0"],
    "stiff": [f"twin.base.{w}.contact_stiffness=1.5e7" for w in ("drive", "caster_front", "caster_back")],
}
STOOD = GROUNDS | {name: ["twin.base.wheels=rigid", *settings] for name, settings in RIGID.items()}


@pytest.mark.parametrize("ground", sorted(STOOD))
def test_a_base_rests_before_its_trial(sweep, ground):
    stands_and_sweeps(sweep, *STOOD[ground])


@pytest.mark.parametrize(
    ("setting", "reported"),
    [
        ("drive.contact_damping=3000", "damping 3000 .* makes the base heavier .* at most 1[67].. N.s/m"),
        ("caster_back.contact_stiffness=2.5e7", r"stiffness 2\.5e\+07 .* makes the wheel hop"),
    ],
)
def test_contacts_that_one_rigid_base_cannot_follow_are_refused(setting, reported):
    with pytest.raises(ContactTooStiff, match=reported):
        laboratory(load("humanoids2024", ["twin.base.wheels=rigid", f"twin.base.{setting}"]).twin, 0)
