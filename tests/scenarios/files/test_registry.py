"""The scenarios that come with the program are valid, strict everywhere, and complete."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

import mjcf
from scenarios import steps
from scenarios.files import registry, yaml_file
from scenarios.files.errors import ScenarioError
from twin.motions.trial_schedule import schedule

LENGTH = re.compile(r" \(([\d.]+) (s|min)\)$")


def mappings(node: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Paths of all mappings in a YAML tree."""
    if isinstance(node, dict):
        yield path
        for key, value in node.items():
            yield from mappings(value, (*path, str(key)))
    elif isinstance(node, list):
        for i, value in enumerate(node):
            yield from mappings(value, (*path, str(i)))


def raw(name: str) -> dict[str, Any]:
    """A packaged scenario as it stands in its file."""
    values: dict[str, Any] = YAML(typ="safe", pure=True).load(registry.find(name).read_text(encoding="utf-8"))
    return values


@pytest.mark.parametrize("name", registry.names())
def test_a_scenario_is_named_after_its_file_and_described_in_a_line(name):
    scenario = steps.load(name)
    assert scenario.name == name
    assert 0 < len(scenario.description.splitlines()) == 1
    assert LENGTH.search(scenario.description)


@pytest.mark.slow
@pytest.mark.parametrize("name", registry.names())
def test_a_scenario_says_how_long_its_recordings_are(name):
    scenario = steps.load(name)
    length, unit = LENGTH.search(scenario.description).groups()
    seconds = sum(motion.duration for motion in schedule(scenario.twin.campaign, mjcf.model(), scenario.seed))
    assert float(length) == pytest.approx(seconds / {"s": 1.0, "min": 60.0}[unit], rel=0.01)


@pytest.mark.parametrize("name", registry.names())
def test_what_a_run_saves_of_a_scenario_is_that_scenario(name, tmp_path: Path):
    for scenario in (steps.load(name), steps.load(name).quick()):
        yaml_file.write(tmp_path / "scenario.yaml", scenario, beside={"versions": steps.versions()})
        assert steps.load(tmp_path / "scenario.yaml") == scenario


@pytest.mark.parametrize("name", [n for n in registry.names() if "extends" not in raw(n)])
def test_an_unknown_field_is_refused_wherever_it_stands(name):
    """Beside the mappings whose keys are names of the user's, where it must be refused as a value."""
    overrides = [".".join((*path, "unheard_of")) + "=1" for path in mappings(raw(name))]
    with pytest.raises(ScenarioError) as info:
        steps.load(name, overrides)
    reported = {line.split()[1].rstrip(":") for line in str(info.value).splitlines()}
    assert {override.removesuffix("=1") for override in overrides} <= reported


def test_the_script_and_its_scenario_have_one_name():
    for path in registry.HERE.glob("*.yaml"):
        assert f'load("{path.stem}")' in path.with_suffix(".py").read_text(encoding="utf-8")
