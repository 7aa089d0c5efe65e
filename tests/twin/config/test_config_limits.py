"""Values no robot and no instrument has are refused at input, with what is possible."""

import pytest

from scenarios import steps
from scenarios.files.errors import ScenarioError

AT_REST = [0.1, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]


def refused(*overrides: str) -> list[str]:
    with pytest.raises(ScenarioError) as info:
        steps.load("humanoids2024", overrides)
    return str(info.value).splitlines()


def test_postures_beyond_the_joints_limits_are_reported_by_joint_value_and_limits():
    lift, wrist = [0.36, *AT_REST[1:]], [*AT_REST[:6], 2.0, 0.0]
    first, second = refused(f"twin.campaign.given_postures={[AT_REST, lift, wrist]}")
    assert first == "--set twin.campaign.given_postures.1.0: torso_lift_joint goes from 0.0 to 0.35 (got 0.36)"
    assert second.startswith("--set twin.campaign.given_postures.2.6: arm_6_joint goes from -1.41371669411540")
    at_limits = [0.35, 0.0, *AT_REST[2:]]
    assert steps.load("humanoids2024", [f"twin.campaign.given_postures={[at_limits]}"])


@pytest.mark.parametrize("name", ["robot_rate", "mocap_rate", "plate_rate"])
@pytest.mark.parametrize("rate", [0.001, 9.0, 1e5])
def test_rates_no_instrument_has_are_refused(name, rate):
    (line,) = refused(f"twin.instruments.{name}={rate}")
    assert line.startswith(f"--set twin.instruments.{name}: must be ") and line.endswith(f"(got {rate})")


def test_a_time_step_that_takes_for_ever_is_refused():
    (line,) = refused("twin.timestep=1e-9")
    assert line.startswith("--set twin.timestep: must be at least 0.00001")
