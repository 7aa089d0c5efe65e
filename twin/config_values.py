"""Types of the values a scenario gives: SI numbers with limits.

What describes the robot or its instruments may be uncertain (`twin.uncertain`); what a person decides or declares, the
campaign and the datasheet, is `Fixed`.
"""

from collections.abc import Iterable
from typing import Annotated, Literal, TypeVar

from pydantic import AfterValidator, ConfigDict, Field, ValidationInfo

from twin.uncertain import DRAWN

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
GivenPosture = tuple[float, float, float, float, float, float, float, float]
Side = Literal[-1, 0, 1]
GivenApproach = tuple[Side, Side, Side, Side, Side, Side, Side, Side]

T = TypeVar("T")


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
