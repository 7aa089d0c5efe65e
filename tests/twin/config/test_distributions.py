import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest

import mjcf
from scenarios import load
from scenarios.files import yaml_file
from scenarios.files.errors import ScenarioError
from twin.campaign import describe_dataset, laboratory
from twin.fields import Distribution, RandomValue, sampled
from twin.simulation import build

GAP = "twin.arm.arm_6_joint.gap"


def scenario(*overrides):
    return load("humanoids2024", overrides)


def test_a_value_given_as_a_distribution_is_its_mean_until_it_is_drawn():
    uniform = scenario(f"{GAP}={{uniform: [0.020, 0.030]}}").twin.arm["arm_6_joint"].gap
    normal = scenario(f"{GAP}={{normal: [0.024, 0.002]}}").twin.arm["arm_6_joint"].gap
    assert uniform == pytest.approx(0.025) and normal == 0.024
    for value in (copy.deepcopy(uniform), pickle.loads(pickle.dumps(uniform))):
        assert value.distribution == Distribution("uniform", 0.020, 0.030)


def test_draws_have_the_distribution_that_is_asked_for():
    rng = np.random.default_rng(0)
    uniform = np.array([Distribution("uniform", 2.0, 5.0).sample(rng) for _ in range(4000)])
    normal = np.array([Distribution("normal", 1.0, 0.1).sample(rng) for _ in range(4000)])
    assert uniform.min() >= 2.0 and uniform.max() <= 5.0
    np.testing.assert_allclose([uniform.mean(), uniform.std()], [3.5, 3.0 / np.sqrt(12.0)], rtol=0.03)
    assert np.abs(normal - 1.0).max() <= 0.3
    np.testing.assert_allclose([normal.mean(), normal.std()], [1.0, 0.1 * 0.9866], rtol=0.03)  # cut at 3 sd


def test_one_draw_does_not_depend_on_another():
    one = scenario(f"{GAP}={{normal: [0.024, 0.002]}}").twin
    more = scenario(
        f"{GAP}={{normal: [0.024, 0.002]}}",
        "twin.arm.arm_1_joint.gap={uniform: [0.001, 0.003]}",
        "twin.base.drive.stiffness.1={normal: [8000.0, 800.0]}",
    ).twin
    gaps = [sampled(config, seed).arm["arm_6_joint"].gap for config, seed in ((one, 3), (more, 3), (one, 4))]
    assert gaps[0] == gaps[1] != gaps[2]
    assert type(gaps[0]) is float
    assert sampled(more, 3).base.drive.stiffness[1] != 8000.0
    assert sampled(more, 3).base.drive.stiffness[0] == one.base.drive.stiffness[0]


def test_a_scenario_without_distributions_is_left_as_it_is():
    config = scenario().twin
    assert sampled(config, 0) is config


def test_distributions_outlive_a_written_file_and_a_changed_field(tmp_path):
    before = scenario(f"{GAP}={{normal: [0.024, 0.002]}}")
    yaml_file.write(tmp_path / "scenario.yaml", before)
    assert "normal: [0.024, 0.002]" in (tmp_path / "scenario.yaml").read_text()
    for after in (load(tmp_path / "scenario.yaml"), before.quick()):
        gap = after.twin.arm["arm_6_joint"].gap
        assert isinstance(gap, RandomValue) and gap.distribution == Distribution("normal", 0.024, 0.002)
    joint = replace(before.twin.arm["arm_6_joint"], stiffness=1100.0)
    assert isinstance(joint.gap, RandomValue)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("{normal: [0.024]}", "write a number, {normal: \\[mean, sd\\]} or {uniform: \\[low, high\\]}, found"),
        ("{lognormal: [0.0, 1.0]}", "write a number"),
        ("{normal: [0.024, 0.001], uniform: [0.0, 0.1]}", "write a number"),
        ("{}", "write a number"),
        ("{normal: [0.024, 0.0]}", "standard deviation of a normal must be positive"),
        ("{uniform: [0.03, 0.02]}", "ends of a uniform must rise"),
        ("{normal: [0.024, 0.010]}", "at least 0 .got -0.00"),
        ("{uniform: [0.02, 0.2]}", "at most 0.1 .got 0.2"),
    ],
)
def test_a_wrong_distribution_is_reported_with_its_place(value, message):
    with pytest.raises(ScenarioError, match=f"{GAP}: .*{message}"):
        scenario(f"{GAP}={value}")


LOOSE = "twin.departures.loosened={gripper2: {sag: 1.0e-3, since: DRAWN}}"


@pytest.mark.parametrize(
    ("path", "found"),
    [
        (LOOSE, lambda c: c.departures.loosened["gripper2"].since),
        ("twin.payload.com=[DRAWN, 0.0, 0.0]", lambda c: c.payload.com[0]),
        ("twin.session.base_translation=DRAWN", lambda c: c.session.base_translation),
        ("twin.session.encoder_zero=DRAWN", lambda c: c.session.encoder_zero),
    ],
)
def test_what_happens_to_a_robot_can_be_drawn(path, found):
    config = scenario(path.replace("DRAWN", "{uniform: [0.01, 0.02]}")).twin
    values = {found(laboratory(config, seed).config) for seed in (1, 2)}
    assert len(values) == 2 and all(0.01 < v < 0.02 and not isinstance(v, RandomValue) for v in values)
    describe_dataset(config, ()).model_dump_json()


def test_what_a_person_decides_is_never_drawn():
    for path in ("twin.campaign.sweep", "twin.datasheet.joint_play", "twin.instruments.mocap_rate"):
        with pytest.raises(ScenarioError, match="valid number"):
            scenario(f"{path}={{uniform: [1.0, 2.0]}}")


def test_a_drawn_value_is_the_robots_truth_and_not_the_laboratorys():
    config = scenario("twin.payload.mass={uniform: [0.3, 0.6]}", f"{GAP}={{uniform: [0.020, 0.030]}}").twin
    lab = laboratory(config, 1)
    truth = {p.name: p.value for p in lab.twin.truth}
    assert truth["backlash.arm_6_joint.gap"] == lab.config.arm["arm_6_joint"].gap != 0.025
    built = build(mjcf.spec(), lab.robot.defects, visual=True).model
    assert built.body("payload").mass[0] == truth["payload.mass"] != 0.45
    assert describe_dataset(config, ()).payload.mass == pytest.approx(0.45)
