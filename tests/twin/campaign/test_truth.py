"""truth.json holds every number that a scenario gives of the robot and its instruments, with a unit."""

from dataclasses import fields, is_dataclass, replace

import pytest

from scenarios import load
from twin.campaign import laboratory, sample
from twin.campaign.recording import _write_truth
from twin.truth import read_parameters

EVERYTHING = (
    "twin.instruments.mocap={scale: 1.0e-4, bias: 2.0e-4, latency: 0.004, swaps: 1.0}",
    "twin.instruments.mocap.cameras=[[3.0, 0.0, 2.5], [0.0, 3.0, 2.5]]",
    "twin.instruments.plate={gain: 0.01, crosstalk: 0.01, force_drift: 0.01, moment_drift: 0.01, cutoff: 100.0}",
    "twin.instruments.plate.force_resolution=0.1",
    "twin.instruments.plate.moment_resolution=0.01",
    "twin.instruments.plate_place={shift: [0.01, 0.02], height: 0.001, yaw: 0.01}",
    "twin.instruments.log={jitter: 1.0e-4, latency: 0.002, velocity_cutoff: 20.0, dropouts: 1.0}",
    "twin.instruments.wrist={force_offset: 1.0, moment_offset: 0.1}",
    "twin.instruments.motor_encoders={once: 1.0e-4, twice: 1.0e-4}",
    *(f"twin.base.{w}.torsion=[500.0, 500.0, 500.0]" for w in ("drive", "caster_front", "caster_back")),
    "twin.base.caster_back.turning_force=8.0",
    "twin.base.caster_front.guide_friction=3.0",
    "twin.gear_form=friction_held",
    "twin.widths.spread=0.1",
)
DECLARED = ("mocap_rate", "plate_rate", "robot_rate", "plate_grid")  # in dataset.json
DERIVED = "pose"  # as T_lab_base
ABSENT = ("caster_front.turning_force", "drive.turning_force", "drive.guide_friction", "caster_back.guide_friction")


def leaves(value, path=()):
    """Places of all numbers in a configuration."""
    if is_dataclass(value):
        children = ((f.name, getattr(value, f.name)) for f in fields(value))
    elif isinstance(value, dict):
        children = value.items()
    elif isinstance(value, tuple):
        children = enumerate(value)
    else:
        return [path] if isinstance(value, (int, float)) and not isinstance(value, bool) else []
    return [leaf for key, child in children for leaf in leaves(child, (*path, key))]


def changed(value, path):
    """The same configuration with one number another."""
    if not path:
        return value * 1.001 if value else 1e-6
    key, *rest = path
    if is_dataclass(value):
        return replace(value, **{key: changed(getattr(value, key), rest)})
    if isinstance(value, dict):
        return value | {key: changed(value[key], rest)}
    return tuple(changed(v, rest) if k == key else v for k, v in enumerate(value))


@pytest.fixture(scope="module")
def full():
    return laboratory(load("humanoids2024", EVERYTHING).twin, 0)


@pytest.fixture(scope="module")
def reported(full, tmp_path_factory):
    """What truth.json says of a configuration, robots drawn but not compiled."""
    folder = tmp_path_factory.mktemp("truth")

    def of(config):
        robot = sample(config, 0)
        true = tuple(p for d in robot.defects for p in d.parameters())
        _write_truth(replace(full, config=config, robot=robot, twin=replace(full.twin, truth=true)), None, folder)
        return read_parameters(folder / "truth.json")

    return of


@pytest.mark.parametrize("part", ["arm", "torso", "base", "payload", "instruments", "friction_held"])
def test_every_number_of_the_scenario_shows_in_the_truth(full, reported, part):
    before = reported(full.config)
    silent = []
    for leaf in leaves(getattr(full.config, part)):
        place = ".".join(map(str, leaf))
        if part == "arm" and leaf[0] not in ("arm_1_joint", "arm_7_joint"):
            continue
        if leaf[0] in (*DECLARED, DERIVED) or place in ABSENT or "markers" in leaf:
            continue
        if reported(changed(full.config, (part, *leaf))) == before:
            silent.append(place)
    assert silent == []


def test_a_robot_that_drives_tells_how_its_wheels_roll(full, reported):
    campaign = replace(full.config.campaign, driving=replace(full.config.campaign.driving, forms=("wheels",)))
    true = {p.name: p for p in reported(replace(full.config, campaign=campaign))}
    assert true["rolling.wheel_left.servo_stiffness"].value == 2000.0
    assert true["rolling.caster_front_left.swivel_friction"].unit == "N.m"
    assert sum(name.startswith("rolling.") for name in true) == 2 * 3 + 4 * 6
    assert not any(p.name.startswith("rolling.") for p in reported(full.config))


def test_names_are_there_once_and_lengths_are_lengths(full, reported):
    true = reported(full.config)
    assert len({p.name for p in true}) == len(true)
    units = {p.name: p.unit for p in true}
    assert units["encoder.torso_lift_joint.motor.offset"] == "m"
    assert units["encoder.arm_1_joint.motor.quantum"] == "rad"
    assert units["gear.torso_lift_joint.rotor_inertia"] == "kg"
    assert units["gear.arm_1_joint.torque_per_ampere"] == "N.m/A"
