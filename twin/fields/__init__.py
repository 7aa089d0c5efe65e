"""Types of the fields of a scenario: numbers with limits, names of the robot's parts, values with a distribution."""

from twin.fields.distributions import Distribution, RandomValue, sampled

__all__ = [
    "Distribution",
    "RandomValue",
    "sampled",
]
