"""Dataclasses of numbers and arrays as JSON and back."""

import json
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest

from calibration.errors import InputError
from calibration.estimate.plain_values import plain, restored


@dataclass(frozen=True)
class Wheel:
    """A wheel.

    Attributes:
        name: Of it.
        stiffness: K (n, 2) along x and y [N/m].
    """

    name: str
    stiffness: np.ndarray


class Quality(NamedTuple):
    rms: float
    r2: float


@dataclass(frozen=True)
class Base:
    wheels: tuple[Wheel, ...]
    pair: tuple[float, int]
    slips: Wheel | None
    quality: Quality = Quality(0.1, 0.2)
    blocks: int = 0


BASE = Base((Wheel("left", np.array([[1.0, np.nan], [0.1, 2.0]])),), (float("nan"), 3), None, Quality(0.3, 0.4))


def test_values_come_back_from_json_bit_for_bit():
    again = restored(Base, json.loads(json.dumps(plain(BASE), allow_nan=False)))
    np.testing.assert_array_equal(again.wheels[0].stiffness, BASE.wheels[0].stiffness)
    assert (again.wheels[0].name, again.slips, again.pair[1]) == ("left", None, 3)
    assert np.isnan(again.pair[0])
    assert (type(again.quality), again.quality) == (Quality, BASE.quality)


def test_a_field_that_is_null_or_has_a_default_may_be_absent():
    some = {name: value for name, value in plain(BASE).items() if name in ("wheels", "pair")}
    again = restored(Base, some)
    assert (again.slips, again.quality, again.blocks) == (None, Quality(0.1, 0.2), 0)


@pytest.mark.parametrize(
    "change",
    [
        {"pair": [1.0]},
        {"pair": [float("inf"), 3]},
        {"pair": [1.0, "3"]},
        {"quality": [1.0]},
        {"wheels": [{"name": "left"}]},
        {"wheels": [{"name": 1, "stiffness": [1.0]}]},
        {"wheels": [{"name": "left", "stiffness": [1.0, 2.0]}]},
        {"wheels": [{"name": "left", "stiffness": [[1.0], [2.0]]}]},
        {"wheels": 3},
    ],
)
def test_a_missing_or_wrong_field_is_named_with_its_place(change):
    with pytest.raises(InputError, match="estimate.json: bundle"):
        restored(Base, plain(BASE) | change, "estimate.json: bundle")


def test_what_has_no_plain_form_is_refused():
    with pytest.raises(TypeError, match="complex"):
        plain(1j)
