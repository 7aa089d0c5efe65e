"""Scenario files: every finding has a place, all come at once, and what is written reads back the same."""

from pathlib import Path
from typing import Annotated, Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter
from pydantic.dataclasses import dataclass

from scenarios.files import registry, yaml_file
from scenarios.files.errors import ScenarioError

STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True, config=STRICT)
class Gear:
    type: Literal["gear"]
    joint: str
    gap: Annotated[float, Field(ge=0, le=0.05)] = 0.0


@dataclass(frozen=True, config=STRICT)
class Tyre:
    type: Literal["tyre"]
    stiffness: float


class Robot(BaseModel):
    model_config = STRICT
    mass: Annotated[float, Field(gt=0)] = 74.0
    size: tuple[float, float] = (0.5, 0.4)


class Spare(BaseModel):
    model_config = STRICT
    mass: float
    size: float


class Example(BaseModel):
    model_config = STRICT
    name: str
    seed: int
    robot: Robot = Robot(mass=70.0)
    defects: tuple[Annotated[Gear | Tyre, Field(discriminator="type")], ...] = ()
    rates: dict[str, float] = {}
    spare: dict[str, Spare] = {}


GOOD = """\
name: example
seed: 3
robot:
  mass: 73.5
defects:
  - {type: gear, joint: arm_1, gap: 1e-4}
  - type: tyre
    stiffness: 1.0e+5
rates: {mocap: 100.0}
"""


def read(tmp_path: Path, text: str, *overrides: str) -> Example:
    (tmp_path / "s.yaml").write_text(text)
    return yaml_file.read(tmp_path / "s.yaml", Example, overrides)


def refused(tmp_path: Path, text: str, *overrides: str) -> list[str]:
    """Lines of the refusal, without the folder."""
    with pytest.raises(ScenarioError) as info:
        read(tmp_path, text, *overrides)
    return str(info.value).replace(f"{tmp_path}/", "").splitlines()


def test_a_good_file_gives_its_values(tmp_path):
    example = read(tmp_path, GOOD)
    assert example.robot == Robot(mass=73.5)
    assert example.defects == (Gear("gear", "arm_1", 1e-4), Tyre("tyre", 1e5))


@pytest.mark.parametrize("number", ["1e-4", "1.0e-4", "1E-4", "0.0001", ".0001"])
def test_every_way_to_write_a_number_is_a_number(tmp_path, number):
    assert read(tmp_path, GOOD.replace("1e-4", number)).defects[0].gap == 1e-4


def test_an_unknown_field_names_its_place_and_the_known_ones(tmp_path):
    (line,) = refused(tmp_path, GOOD.replace("  mass:", "  mas:"))
    assert line == "s.yaml:4:3: robot.mas: unknown field; did you mean mass? (known here: mass, size)"


def test_an_unknown_field_in_a_union_names_the_fields_of_its_own_kind(tmp_path):
    (line,) = refused(tmp_path, GOOD.replace("gap:", "gape:"))
    assert line == "s.yaml:6:32: defects.0.gape: unknown field; did you mean gap? (known here: gap, joint, type)"


def test_a_missing_field_is_placed_where_it_should_stand(tmp_path):
    assert refused(tmp_path, GOOD.replace("seed: 3\n", "")) == ["s.yaml:1:1: seed: missing"]
    (line,) = refused(tmp_path, GOOD.replace("    stiffness: 1.0e+5\n", ""))
    assert line == "s.yaml:7:5: defects.1.stiffness: missing"


@pytest.mark.parametrize(
    ("good", "bad", "finding"),
    [
        ("seed: 3", "seed: '3'", 's.yaml:2:7: seed: must be a valid integer (got "3")'),
        ("seed: 3", "seed: true", "s.yaml:2:7: seed: must be a valid integer (got true)"),
        ("mass: 73.5", "mass: -1", "s.yaml:4:9: robot.mass: must be greater than 0 (got -1)"),
        ("mass: 73.5", "mass:", "s.yaml:4:3: robot.mass: must be a valid number (got null)"),
        ("mass: 73.5", "mass: .nan", "s.yaml:4:9: robot.mass: must be a finite number (got NaN)"),
        ("mass: 73.5", "size: [1, x]", 's.yaml:4:13: robot.size.1: must be a valid number (got "x")'),
        ("1e-4", "0.5", "s.yaml:6:37: defects.0.gap: must be at most 0.05 (got 0.5)"),
        ("mocap: 100.0", "mocap: fast", 's.yaml:9:16: rates.mocap: must be a valid number (got "fast")'),
        ("\n  mass: 73.5", " heavy", None),
        ("type: tyre", "type: wheel", None),
    ],
)
def test_a_wrong_value_is_reported_with_its_place_and_itself(tmp_path, good, bad, finding):
    assert good in GOOD
    (line,) = refused(tmp_path, GOOD.replace(good, bad))
    if finding:
        assert line == finding
    assert line.startswith("s.yaml:") and "(got " in line


def test_all_findings_come_at_once_in_the_order_of_the_file(tmp_path):
    text = GOOD.replace("seed: 3", "sed: 3").replace("73.5", "heavy").replace("1e-4", "1")
    assert [line.split(": ")[:2] for line in refused(tmp_path, text)] == [
        ["s.yaml:1:1", "seed"],
        ["s.yaml:2:1", "sed"],
        ["s.yaml:4:9", "robot.mass"],
        ["s.yaml:6:37", "defects.0.gap"],
    ]


@pytest.mark.parametrize(
    ("text", "start", "words"),
    [
        (GOOD + "seed: 4\n", "s.yaml:10:1: ", "duplicate key"),
        (GOOD.replace("mass: 73.5", "mass: 73.5\n  mass: 74"), "s.yaml:5:3: ", "duplicate key"),
        ("name: [a,\nseed: 3", "s.yaml:2:8: ", "not YAML"),
        ("name: a: b", "s.yaml:1:8: ", "not YAML"),
        ("name: a\n---\nname: b\n", "s.yaml:2:1: ", "another document"),
        ("name: \x07", "s.yaml: ", "not YAML"),
        ("name: *there", "s.yaml:1:7: ", "undefined alias"),
        ("name: !!python/name:os.system x", "s.yaml: ", "tag"),
        ("[" * 800, "s.yaml: ", "deep"),
        ("", "s.yaml:1:1: ", "empty"),
        ("# only a comment\n", "s.yaml:1:1: ", "empty"),
        ("- name: a\n", "s.yaml:1:1: ", "a list"),
        ("hello", "s.yaml:1:1: ", "single value 'hello'"),
    ],
)
def test_what_is_no_mapping_of_fields_is_reported_once(tmp_path, text, start, words):
    (line,) = refused(tmp_path, text)
    assert line.startswith(start) and words in line


def test_unreadable_files_are_reported(tmp_path):
    (tmp_path / "binary.yaml").write_bytes(b"name: \xff\xfe")
    for path, words in (("missing.yaml", "no such file"), ("binary.yaml", "UTF-8"), ("", "is a folder")):
        with pytest.raises(ScenarioError, match=words):
            yaml_file.read(tmp_path / path, Example)


def test_overrides_are_applied_in_order_before_validation(tmp_path):
    example = read(tmp_path, GOOD.replace("seed: 3\n", ""), "seed=1", "seed=7", "defects.0.gap=2e-3", "rates.plate=1e3")
    assert (example.seed, example.defects[0].gap, example.rates) == (7, 2e-3, {"mocap": 100.0, "plate": 1000.0})


def test_an_override_within_a_default_keeps_the_rest_of_that_default(tmp_path):
    assert read(tmp_path, "name: a\nseed: 1\n", "robot.size=[1.0, 2.0]").robot == Robot(mass=70.0, size=(1.0, 2.0))


@pytest.mark.parametrize(
    ("override", "finding"),
    [
        ("robot.mass=-2", "--set robot.mass: must be greater than 0 (got -2)"),
        ("robot.mas=2", "--set robot.mas: unknown field; did you mean mass? (known here: mass, size)"),
        ("robt.mass=2", "did you mean robot? (known here: defects, name, rates, robot, seed, spare)"),
        ("robot=5", "--set robot: "),
        ("robot={mas: 5}", "--set robot.mas: unknown field"),
        ("defects.0={type: tyre}", "--set defects.0.stiffness: missing"),
        ("spare.left.mass=1", "--set spare.left.size: missing"),
        ("seed.x=2", "--set seed.x: seed is a single value, it has no field 'x'"),
        ("defects.7.gap=0", "--set defects.7.gap: '7' is not a position, counted from 0, in a list of 2"),
        ("seed", "--set seed: write path.to.field=value"),
        ("=3", "--set =3: write path.to.field=value"),
        ("robot..mass=3", "--set robot..mass=3: write path.to.field=value"),
        ("seed=[1", "--set seed:1:3: not YAML"),
    ],
)
def test_a_wrong_override_is_reported_as_an_override(tmp_path, override, finding):
    (line,) = refused(tmp_path, GOOD, override)
    assert line.startswith("--set ") and finding in line


def test_findings_of_the_file_and_of_overrides_come_together(tmp_path):
    lines = refused(tmp_path, GOOD.replace("seed: 3", "seed: x"), "robot.mass=-2", "names=3")
    assert [line.split(" ")[0] for line in lines] == ["s.yaml:2:7:", "--set", "--set"]


def test_keys_beside_the_model_are_validated_and_left_out(tmp_path):
    (tmp_path / "s.yaml").write_text(GOOD + "versions: {numpy: 2.4.6}\n")
    beside = {"versions": dict[str, str]}
    assert yaml_file.read(tmp_path / "s.yaml", Example, beside=beside) == read(tmp_path, GOOD)
    (tmp_path / "s.yaml").write_text(GOOD.replace("seed: 3", "seed: x") + "versions: {numpy: 2}\n")
    with pytest.raises(ScenarioError) as info:
        yaml_file.read(tmp_path / "s.yaml", Example, beside=beside)
    assert [line.split(": ")[1] for line in str(info.value).splitlines()] == ["versions.numpy", "seed"]


finite = st.floats(allow_nan=False, allow_infinity=False)
texts = st.text(st.characters(blacklist_categories=("Cs", "Cc")), max_size=20)
gears = st.builds(Gear, st.just("gear"), texts, st.floats(0, 0.05))
tyres = st.builds(Tyre, st.just("tyre"), finite)
robots = st.builds(Robot, mass=st.floats(min_value=1e-300, allow_infinity=False), size=st.tuples(finite, finite))
examples = st.builds(
    Example,
    name=texts,
    seed=st.integers(-(2**63), 2**63 - 1),
    robot=robots,
    defects=st.lists(gears | tyres, max_size=3).map(tuple),
    rates=st.dictionaries(texts, finite, max_size=3),
)


@settings(deadline=None, derandomize=True)
@given(example=examples)
def test_what_is_written_reads_back_bit_for_bit(tmp_path_factory, example):
    path = tmp_path_factory.mktemp("round") / "s.yaml"
    yaml_file.write(path, example, {"versions": {"numpy": "2.4.6"}})
    assert yaml_file.read(path, Example, beside={"versions": dict[str, str]}) == example


def test_a_pydantic_dataclass_is_read_like_a_model(tmp_path):
    yaml_file.write(tmp_path / "g.yaml", Gear("gear", "arm_1", 0.01))
    assert (tmp_path / "g.yaml").read_text() == "type: gear\njoint: arm_1\ngap: 0.01\n"
    assert yaml_file.read(tmp_path / "g.yaml", Gear) == Gear("gear", "arm_1", 0.01)


def test_an_unknown_scenario_is_reported_with_the_known_ones(monkeypatch, tmp_path):
    (tmp_path / "humanoids2024.yaml").write_text("name: humanoids2024\n")
    monkeypatch.setattr(registry, "HERE", tmp_path)
    assert registry.find("humanoids2024") == tmp_path / "humanoids2024.yaml"
    with pytest.raises(ScenarioError, match="did you mean humanoids2024.*tiago-twin list"):
        registry.find("humanoid2024")


def test_a_type_without_a_schema_still_gives_its_findings(tmp_path):
    class Odd:
        """A type no JSON schema describes."""

    class Holder(BaseModel):
        model_config = ConfigDict(extra="forbid", arbitrary_types_allowed=True)
        odd: Odd | None = None

    (tmp_path / "s.yaml").write_text("even: 1\n")
    with pytest.raises(ScenarioError, match=r"s.yaml:1:1: even: unknown field$"):
        yaml_file.read(tmp_path / "s.yaml", Holder)
    assert TypeAdapter(Holder).validate_python({}).odd is None
