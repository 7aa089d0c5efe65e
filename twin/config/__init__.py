"""A robot and its campaign as a scenario describes them."""

from twin.config.base import Base
from twin.config.campaign import Campaign
from twin.config.distributions import Distribution, RandomValue, sampled
from twin.config.disturbances import Departures
from twin.config.instruments import Instruments
from twin.config.robot import ArmJoint
from twin.config.twin import TwinConfig

__all__ = [
    "ArmJoint",
    "Base",
    "Campaign",
    "Departures",
    "Distribution",
    "Instruments",
    "RandomValue",
    "TwinConfig",
    "sampled",
]
