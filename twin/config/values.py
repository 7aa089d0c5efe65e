"""Types of the values a scenario gives: SI numbers with limits.

What describes the robot or its instruments may be uncertain (`twin.uncertain`); what a person decides or declares, the
campaign and the datasheet, is `Fixed`.
"""

from collections.abc import Iterable
from typing import Annotated, Literal, TypeVar

from pydantic import AfterValidator, ConfigDict, Field, ValidationInfo
from pydantic_core import InitErrorDetails, PydanticCustomError

import mjcf
from twin.config.distributions import DRAWN
from twin.config.names import ARM, TORSO, refuse

STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
FixedPositive = Annotated[float, Field(gt=0.0)]
FixedNonNegative = Annotated[float, Field(ge=0.0)]
Value = Annotated[float, DRAWN]
Positive = Annotated[float, Field(gt=0.0), DRAWN]
NonNegative = Annotated[float, Field(ge=0.0), DRAWN]
Angle = Annotated[float, Field(ge=-0.5, le=0.5), DRAWN]
Count = Annotated[int, Field(ge=1)]
Vector3 = tuple[float, float, float]
Point = tuple[Value, Value, Value]
Twist = tuple[Value, Value, Value, Value, Value, Value]
Side = Literal[-1, 0, 1]
GivenApproach = tuple[Side, Side, Side, Side, Side, Side, Side, Side]

T = TypeVar("T")
Rate = Annotated[float, Field(ge=10.0, le=1000.0)]
"""Of a robot's log or a motion capture [Hz]: from a throttled topic to the steps of the simulation."""

_Posture = tuple[float, float, float, float, float, float, float, float]


def _within_limits(posture: _Posture) -> _Posture:
    """Each joint [m, rad], the lift first, between the limits of the nominal robot."""
    beyond = []
    for k, (name, value) in enumerate(zip((TORSO, *ARM), posture, strict=True)):
        low, high = mjcf.model().joint(name).range.tolist()
        if not low <= value <= high:
            said = {"joint": name, "low": low, "high": high}
            error = PydanticCustomError("joint_limit", "{joint} goes from {low} to {high}", said)
            beyond.append(InitErrorDetails(type=error, loc=(k,), input=value))
    refuse("GivenPosture", beyond)
    return posture


GivenPosture = Annotated[_Posture, AfterValidator(_within_limits)]


def in_order(names: Iterable[str]) -> AfterValidator:
    """Put a mapping's entries into this order of their names, so that no order of a file matters."""
    order = {name: k for k, name in enumerate(names)}
    return AfterValidator(lambda values: dict(sorted(values.items(), key=lambda entry: order[entry[0]])))


def _by_name(values: dict[str, T]) -> dict[str, T]:
    return dict(sorted(values.items()))


BY_NAME = AfterValidator(_by_name)
"""As `in_order`, of names that are not known beforehand."""


def _one_each(approaches: tuple[GivenApproach, ...], given: ValidationInfo) -> tuple[GivenApproach, ...]:
    """One for each of the `given_postures` beside them, or none at all."""
    n = len(given.data.get("given_postures", ()))
    if approaches and len(approaches) != n:
        raise ValueError(f"{len(approaches)} approaches for {n} given_postures; give one each, or none")
    return approaches


GivenApproaches = Annotated[tuple[GivenApproach, ...], AfterValidator(_one_each)]
