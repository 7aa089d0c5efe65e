"""A robot and its campaign as a scenario describes them."""

from twin.config.instruments import Instruments
from twin.config.robot import ArmJoint
from twin.config.twin import Departures, RobotConfig, SampledConfig, TwinConfig, sampled_config

__all__ = [
    "ArmJoint",
    "Departures",
    "Instruments",
    "RobotConfig",
    "SampledConfig",
    "TwinConfig",
    "sampled_config",
]
