"""Values of a scenario that are sampled for each robot.

    {normal: [mean, sd]}     cut at 3 sd on either side        {uniform: [low, high]}

As a number a random value is its mean: the datasheet's value, and what dataset.json describes. `sampled` replaces it by
one robot's own, from a stream named after its place in the scenario, so that no sample depends on another.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, Literal, TypeVar

import numpy as np
from pydantic import GetCoreSchemaHandler, ValidatorFunctionWrapHandler
from pydantic_core import CoreSchema, core_schema

from twin.random_streams import generator

_CUT = 3.0  # [sd] at which a normal ends
_FORM = "write a number, {normal: [mean, sd]} or {uniform: [low, high]}"
T = TypeVar("T")


@dataclass(frozen=True)
class Distribution:
    """A distribution of one value.

    Attributes:
        kind: `normal` or `uniform`.
        first: Mean, or lower end.
        second: Standard deviation, or upper end.
    """

    kind: Literal["normal", "uniform"]
    first: float
    second: float

    @property
    def mean(self) -> float:
        """Expectation."""
        return self.first if self.kind == "normal" else 0.5 * (self.first + self.second)

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest value."""
        if self.kind == "normal":
            return self.first - _CUT * self.second, self.first + _CUT * self.second
        return self.first, self.second

    def sample(self, rng: np.random.Generator) -> float:
        """One value."""
        if self.kind == "uniform":
            return float(rng.uniform(self.first, self.second))
        z = rng.normal()
        while abs(z) > _CUT:
            z = rng.normal()
        return float(self.first + self.second * z)


class RandomValue(float):
    """A number with a distribution, of which it is the mean."""

    distribution: Distribution

    def __new__(cls, distribution: Distribution) -> "RandomValue":
        """The mean of a distribution."""
        value = super().__new__(cls, distribution.mean)
        value.distribution = distribution
        return value

    def __reduce__(self) -> tuple[Callable[..., "RandomValue"], tuple[Distribution]]:
        """Copy and pickle with the distribution."""
        return RandomValue, (self.distribution,)


def _validate(value: Any, handler: ValidatorFunctionWrapHandler) -> float:
    """Accept a number, or a distribution whose ends are accepted as numbers."""
    if isinstance(value, RandomValue):
        distribution = value.distribution
    elif isinstance(value, Mapping):
        distribution = _distribution(value)
    else:
        return float(handler(value))
    for end in distribution.ends:
        handler(end)
    return RandomValue(distribution)


def _distribution(value: Mapping[Any, Any]) -> Distribution:
    kind, numbers = next(iter(value.items()), ("", ()))
    well_formed = (
        len(value) == 1
        and kind in ("normal", "uniform")
        and isinstance(numbers, (list, tuple))
        and len(numbers) == 2
        and all(isinstance(n, (int, float)) and not isinstance(n, bool) and np.isfinite(n) for n in numbers)
    )
    if not well_formed:
        raise ValueError(f"{_FORM}, found {dict(value)}")
    first, second = map(float, numbers)
    if kind == "normal" and second <= 0.0:
        raise ValueError(f"the standard deviation of a normal must be positive, found {second:g}")
    if kind == "uniform" and second <= first:
        raise ValueError(f"the ends of a uniform must rise, found {first:g}, {second:g}")
    return Distribution("normal" if kind == "normal" else "uniform", first, second)


def _serialise(value: float) -> float | dict[str, list[float]]:
    if isinstance(value, RandomValue):
        d = value.distribution
        return {d.kind: [d.first, d.second]}
    return value


class Drawn:
    """Annotation of a number that may be given as a distribution; put after its limits, which hold for both ends."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Wrap the number's own schema."""
        return core_schema.no_info_wrap_validator_function(
            _validate, handler(source), serialization=core_schema.plain_serializer_function_ser_schema(_serialise)
        )


DRAWN = Drawn()


def sampled(values: T, seed: int, *path: str) -> T:
    """The same values with every random one replaced by its sample; `path` is their place in the scenario."""
    if isinstance(values, RandomValue):
        return values.distribution.sample(generator(seed, "value", ".".join(path)))  # type: ignore[return-value]
    if is_dataclass(values) and not isinstance(values, type):
        old = {f.name: getattr(values, f.name) for f in fields(values)}
        new = {name: sampled(value, seed, *path, name) for name, value in old.items()}
        changed = {name: value for name, value in new.items() if value is not old[name]}
        return replace(values, **changed) if changed else values
    if isinstance(values, Mapping):
        found = {key: sampled(value, seed, *path, str(key)) for key, value in values.items()}
        return found if any(found[k] is not v for k, v in values.items()) else values  # type: ignore[return-value]
    if isinstance(values, tuple):
        several = tuple(sampled(value, seed, *path, str(k)) for k, value in enumerate(values))
        return several if any(a is not b for a, b in zip(several, values, strict=True)) else values  # type: ignore[return-value]
    return values
