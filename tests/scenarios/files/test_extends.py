"""Scenarios that extend others: the values of each file on the next, every finding in its own file."""

from pathlib import Path

import pytest

from scenarios import steps
from scenarios.files.errors import ScenarioError


def written(folder: Path, name: str, extends: str, *values: str) -> Path:
    """A scenario file whose fourth line is the first of its values."""
    text = f"name: {name}\nextends: {extends}\nset:\n" + "".join(f"  {line}\n" for line in values)
    path = folder / f"{name}.yaml"
    path.write_text(text + f"description: Mine, {name}\n", encoding="utf-8")
    return path


def refused(path: Path, *overrides: str) -> list[str]:
    """Lines of the refusal, without the folder."""
    with pytest.raises(ScenarioError) as info:
        steps.load(path, overrides)
    return str(info.value).replace(f"{path.parent}/", "").splitlines()


def test_an_extension_is_the_other_scenario_but_for_its_values():
    other, mine = steps.load("humanoids2024"), steps.load("payload")
    assert mine.name == "payload" and mine.twin.campaign.push == 20.0
    assert mine.twin.arm == other.twin.arm and mine.seed == other.seed


def test_values_come_one_file_after_the_other_and_the_command_line_last(tmp_path):
    written(tmp_path, "first", "unmodelled", "twin.arm.arm_6_joint.gap: 0.01", "twin.arm.arm_5_joint.gap: 0.01")
    path = written(tmp_path, "second", "first.yaml", "twin.arm.arm_6_joint.gap: 0.02", "seed: 5")
    mine, other = steps.load(path, ["seed=6"]), steps.load("unmodelled")
    assert (mine.name, mine.description, mine.seed) == ("second", "Mine, second", 6)
    assert [mine.twin.arm[f"arm_{i}_joint"].gap for i in (5, 6)] == [0.01, 0.02]
    assert mine.twin.departures == other.twin.departures and mine.twin.gear_form == "friction_held"


def test_a_file_may_say_only_what_differs(tmp_path):
    path = tmp_path / "my robot.yaml"
    path.write_text("extends: short\nset: {seed: 9}\n", encoding="utf-8")
    mine, other = steps.load(path), steps.load("short")
    assert (mine.name, mine.seed, mine.description) == ("my_robot", 9, other.description)
    path.write_text("extends: short\n", encoding="utf-8")
    assert steps.load(path).twin == other.twin


@pytest.mark.parametrize(
    ("values", "finding"),
    [
        (["twin.arm.arm_6_joint.gap: -0.1"], "4:29: twin.arm.arm_6_joint.gap: must be at least"),
        (["twin.base:", "  drive: {stifness: 3}"], "5:13: twin.base.drive.stifness: unknown field; did you"),
        (["twin.base:", "  drive: {friction: 3}"], "5:5: twin.base.drive.stiffness: missing"),
        (["twin.base.drive.damping: [1.0, 2.0]"], "4:3: twin.base.drive.damping.2: missing"),
        (["twin.campain.push: 1.0"], "4:3: twin.campain: unknown field; did you mean campaign"),
        (["twin..campaign: 1.0"], "4:3: set.twin..campaign: write path.to.field"),
        (["seed.root: 1"], "4:3: seed.root: seed is a single value"),
        (["seed: 3=4"], "4:9: seed: must be a valid integer"),
        (["twin.timestep: .nan"], "4:18: twin.timestep: must be a finite number"),
    ],
)  # fmt: skip
def test_a_finding_has_the_place_it_stands_at_in_the_file_that_extends(tmp_path, values, finding):
    assert any(line.startswith(f"mine.yaml:{finding}") for line in refused(written(tmp_path, "mine", "short", *values)))


def test_findings_come_at_once_each_from_its_own_file(tmp_path):
    written(tmp_path, "first", "humanoids2024", "seed: -1", "twin.campaign.push: 1000.0")
    path = written(tmp_path, "second", "first.yaml", "twin.timestep: 1.0")
    assert [line.split(": ")[:2] for line in refused(path, "twin.payload.mass=9", "twin.campaign.push=-1")] == [
        ["first.yaml:4:9", "seed"],
        ["second.yaml:4:18", "twin.timestep"],
        ["--set twin.payload.mass", "must be at most 3 (got 9)"],
        ["--set twin.campaign.push", "must be at least 0 (got -1)"],
    ]


def test_a_file_that_extends_itself_in_the_end_is_refused(tmp_path):
    (line,) = refused(written(tmp_path, "mine", "mine.yaml", "seed: 1"))
    assert line == "mine.yaml:2:10: extends: mine.yaml extends mine.yaml; a scenario cannot extend itself"
    written(tmp_path, "first", "second.yaml", "seed: 1")
    (line,) = refused(written(tmp_path, "second", "first.yaml", "seed: 1"))
    assert line.startswith("first.yaml:2:10: extends: second.yaml extends first.yaml extends second.yaml;")


def test_what_is_extended_must_exist_and_is_reported_where_it_does_not(tmp_path):
    (line,) = refused(written(tmp_path, "mine", "humanoids2023", "seed: 1"))
    assert line.startswith("mine.yaml:2:10: extends: humanoids2023: ") and "did you mean humanoids2024" in line


def test_an_extension_has_no_fields_but_its_own(tmp_path):
    path = written(tmp_path, "mine", "short", "seed: 1")
    path.write_text(path.read_text() + "twin: {}\n")
    (line,) = refused(path)
    assert line == "mine.yaml:6:1: twin: unknown field (known here: description, extends, name, set)"
