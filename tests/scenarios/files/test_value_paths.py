"""`show`: every value that `--set` can reach, with unit, range, default and meaning."""

import re

import pytest

from scenarios.files.value_paths import value_paths
from scenarios.steps import load


@pytest.fixture(scope="module")
def paths():
    return {one.path: one for one in value_paths(load("humanoids2024"))}


def test_a_number_has_unit_range_and_meaning(paths):
    gap = paths["twin.arm.arm_6_joint.gap"]
    assert (gap.unit, gap.range) == ("rad", "0 <= x <= 0.1")
    assert "play" in gap.meaning.lower() or "backlash" in gap.meaning.lower()
    assert "[" not in gap.meaning


@pytest.mark.parametrize("name", ["humanoids2024", "laboratory"])
def test_every_value_has_a_meaning_of_its_own_and_every_decimal_a_unit(name):
    found = value_paths(load(name))
    assert [one.path for one in found if one.meaning in ("", "Robot and laboratory")] == []
    assert [one.path for one in found if re.fullmatch(r"-?[\d.e-]*\.[\d.e-]*", one.value) and not one.unit] == []


def test_choices_and_defaults_are_named(paths):
    assert paths["seed"].default == "0"
    assert " | " in paths["calibration.terms"].range
    assert "total" in paths["calibration.terms"].range


@pytest.mark.parametrize("name", ["humanoids2024", "unmodelled", "heins2022", "reality"])
def test_every_value_can_be_set_to_itself_by_its_path(name):
    found = [one for one in value_paths(load(name)) if one.path.startswith("twin.") and one.value != "null"]
    assert len(found) > 100
    assert load(name, [f"{one.path}={one.value}" for one in found]) == load(name)
