"""Types of the values of a scenario: SI numbers with limits.

What describes the robot or its instruments may have a distribution (`twin.fields.distributions`); what a person decides
or declares, the campaign and the datasheet, is `Fixed`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    SerializerFunctionWrapHandler,
    ValidationInfo,
)
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError, core_schema

import mjcf
from twin.fields.distributions import DRAWN
from twin.fields.names import ARM, TORSO, refuse

STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
FixedPositive = Annotated[float, Field(gt=0.0)]
FixedNonNegative = Annotated[float, Field(ge=0.0)]
Value = Annotated[float, DRAWN]
Positive = Annotated[float, Field(gt=0.0), DRAWN]
NonNegative = Annotated[float, Field(ge=0.0), DRAWN]
AtLeast1000 = Annotated[float, Field(ge=1e3), DRAWN]
Angle = Annotated[float, Field(ge=-0.5, le=0.5), DRAWN]
Count = Annotated[int, Field(ge=1)]
Vector3 = tuple[float, float, float]


def point(values: Iterable[float]) -> Vector3:
    """Three numbers, an array's or others, as plain ones."""
    x, y, z = (float(v) for v in values)
    return x, y, z


def _tuple(values: Any) -> Any:
    """A list or an array (n,) as a tuple."""
    plain = values.tolist() if isinstance(values, np.ndarray) else values
    return tuple(plain) if isinstance(plain, list) else plain


Point = Annotated[tuple[Value, Value, Value], BeforeValidator(_tuple)]
Twist = Annotated[tuple[Value, Value, Value, Value, Value, Value], BeforeValidator(_tuple)]
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
            context = {"joint": name, "low": low, "high": high}
            error = PydanticCustomError("joint_limit", "{joint} goes from {low} to {high}", context)
            beyond.append(InitErrorDetails(type=error, loc=(k,), input=value))
    refuse("GivenPosture", beyond)
    return posture


GivenPosture = Annotated[_Posture, AfterValidator(_within_limits)]


def in_order(names: Iterable[str]) -> AfterValidator:
    """Put a mapping's entries into this order of their names, so that no order of a file matters."""
    order = {name: k for k, name in enumerate(names)}
    return AfterValidator(lambda values: dict(sorted(values.items(), key=lambda entry: order[entry[0]])))


@dataclass(frozen=True)
class OneOfKind:
    """Annotation of a value of one of several classes, named by its field `kind`.

    Attributes:
        classes: Dataclasses with a default for `kind`.
    """

    classes: tuple[type, ...]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Choose by kind; none, where there is no class."""
        choices = {vars(c)["kind"]: handler.generate_schema(c) for c in self.classes}
        return core_schema.tagged_union_schema(choices or {"": core_schema.none_schema()}, discriminator="kind")


@dataclass(frozen=True)
class Keyed:
    """Annotation of a mapping whose values contain their own key: a file states it once, as the key.

    Attributes:
        field: The field of each value that is its key.
    """

    field: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Wrap the mapping's own schema."""
        bare = core_schema.wrap_serializer_function_ser_schema(self._without_key)
        return core_schema.no_info_before_validator_function(self._with_key, handler(source), serialization=bare)

    def _with_key(self, values: Any) -> Any:
        if not isinstance(values, Mapping):
            return values
        return {k: {self.field: k, **v} if isinstance(v, Mapping) else v for k, v in values.items()}

    def _without_key(self, values: Any, handler: SerializerFunctionWrapHandler) -> Any:
        """Nor the kind, which the name of the mapping implies."""
        left_out = (self.field, "kind")
        return {k: {n: x for n, x in v.items() if n not in left_out} for k, v in handler(values).items()}


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
