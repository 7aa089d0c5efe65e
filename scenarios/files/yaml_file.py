"""Values of a typed model, to and from a YAML file a person writes.

Every finding is one line, `file:line:column: path.to.field: message (got value)`, and all of them are
reported together. YAML 1.2 (`1e-4` is a number, `on` is text), strict types, no duplicate keys.
An override is text, `path.to.field=value`, its value read as YAML.
"""

import datetime
import io
import json
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq, TaggedScalar

from calibration.errors import InputError
from calibration.untrusted import read_text, yaml_of
from scenarios.files.errors import ScenarioError
from scenarios.files.overrides import Override
from scenarios.files.validation_messages import Source

T = TypeVar("T")


def read(
    path: Path | str,
    model: type[T],
    overrides: Sequence[str | Override] = (),
    beside: Mapping[str, Any] | None = None,
    prepare: Callable[[dict[str, Any]], dict[str, Any]] | None = None,
) -> T:
    """Read, override and validate one file.

    Args:
        path: A YAML file holding one mapping.
        model: A pydantic model or dataclass that forbids unknown fields.
        overrides: `path.to.field=value` from the command line, or values of another file; applied before validation,
            in this order.
        beside: Types of further top-level keys, which are validated and then left out.
        prepare: Writes out short forms of the file's values before they are validated.

    Raises:
        ScenarioError: Something is wrong; every finding, one a line.
    """
    path = Path(path)
    tree = mapping(path)
    values = _plain(tree, str(path))
    values = values if prepare is None else prepare(values)
    found, values = _split_beside(Source(str(path), tree, values), beside or {})
    adapter = TypeAdapter(model)
    applied = [given if isinstance(given, Override) else _override(given) for given in overrides]
    if applied:
        values = _complete(adapter, values)
        refused = [(override, override.apply(values)) for override in applied]
        found += [f"{o.where(o.keys)[-1]}{o.path}: {message}" for o, message in refused if message]
    try:
        instance = adapter.validate_json(json.dumps(values), strict=True)
    except ValidationError as error:
        found += Source(str(path), tree, values, applied).findings(error, adapter)
    if found:
        raise ScenarioError("\n".join(found))
    return instance


def mapping(path: Path) -> CommentedMap:
    """The mapping a file holds, with the line and column of every value.

    Raises:
        ScenarioError: The file cannot be read as YAML, or holds something else.
    """
    try:
        text = read_text(path)
    except InputError as error:
        raise ScenarioError(str(error)) from error
    tree = _parse(text, str(path))
    if not isinstance(tree, CommentedMap):
        kind = "the file is empty" if tree is None else f"the file holds {_kind(tree)}"
        raise ScenarioError(f"{path}:1:1: {kind}; write `field: value` lines")
    return tree


def write(path: Path | str, instance: Any, beside: Mapping[str, Any] | None = None) -> None:
    """Write every resolved value, floats with all their digits, lists of scalars on one line.

    Args:
        path: The file to write.
        instance: A pydantic model or dataclass.
        beside: Further top-level keys and their values, as `read` takes them.
    """
    Path(path).write_text(text(instance, beside), encoding="utf-8")


def text(instance: Any, beside: Mapping[str, Any] | None = None) -> str:
    """What `write` writes."""
    values = TypeAdapter(type(instance)).dump_python(instance, mode="json", by_alias=True)
    yaml = YAML()
    yaml.width = 10**6
    stream = io.StringIO()
    yaml.dump(_styled({**values, **(beside or {})}), stream)
    return stream.getvalue()


@lru_cache(maxsize=32)
def _parse(text: str, where: str) -> Any:
    """Load YAML with the line and column of every value; nobody edits what is found."""
    try:
        return yaml_of(text, where, YAML(typ="rt", pure=True).load)
    except InputError as error:
        raise ScenarioError(str(error)) from error


def _plain(node: Any, place: str) -> Any:
    """Return the node as dict, list, str, int, float, bool or None; keys are text."""
    if isinstance(node, CommentedMap):
        return {str(key): _plain(value, place) for key, value in node.items()}
    if isinstance(node, CommentedSeq):
        return [_plain(value, place) for value in node]
    if isinstance(node, TaggedScalar):
        raise ScenarioError(f"{place}: the tag {node.tag.value} means nothing here; write the plain value")
    if isinstance(node, datetime.date):
        return node.isoformat()
    for scalar in (bool, int, float, str):
        if isinstance(node, scalar):
            return scalar(node)
    return node


def _kind(node: Any) -> str:
    return "a list" if isinstance(node, CommentedSeq) else f"the single value {str(node)[:40]!r}"


def _override(text: str) -> Override:
    path, equals, value = text.partition("=")
    if not equals or not all(path.split(".")):
        raise ScenarioError(f"--set {text}: write path.to.field=value")
    return Override(path, _plain(_parse(value, f"--set {path}"), f"--set {path}"))


def _split_beside(source: Source, beside: Mapping[str, Any]) -> tuple[list[str], dict[str, Any]]:
    """Validate the keys of `beside`; return what is wrong with them, and the values without them."""
    found: list[str] = []
    for key in beside.keys() & source.values.keys():
        adapter = TypeAdapter(beside[key])
        try:
            adapter.validate_json(json.dumps(source.values[key]), strict=True)
        except ValidationError as error:
            found += source.findings(error, adapter, (key,))
    return found, {key: value for key, value in source.values.items() if key not in beside}


def _complete(adapter: TypeAdapter[Any], values: dict[str, Any]) -> dict[str, Any]:
    """Fill in every default, so that an override may reach into one; a faulty file is returned as it is."""
    try:
        instance = adapter.validate_json(json.dumps(values), strict=True)
    except ValidationError:
        return values
    complete: dict[str, Any] = adapter.dump_python(instance, mode="json", by_alias=True)
    return complete


def _styled(value: Any) -> Any:
    """Return the value for ruamel.yaml, lists of scalars in one line."""
    if isinstance(value, Mapping):
        return CommentedMap((key, _styled(inner)) for key, inner in value.items())
    if isinstance(value, list):
        items = CommentedSeq(_styled(inner) for inner in value)
        if not any(isinstance(inner, (Mapping, list)) for inner in value):
            items.fa.set_flow_style()
        return items
    return value
