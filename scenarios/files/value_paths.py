"""Every value of a scenario that `--set` can reach: path, value, unit, range, default and meaning, read off the types.

Units and meanings are those of the docstrings: `name: Meaning [unit].` under `Attributes:`.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import TypeAdapter

from scenarios.files.validation_messages import inner_schemas, member_schemas

Schema = Mapping[str, Any]
_ATTRIBUTE = re.compile(r"^ {4}(\w+): (.+?)(?=^ {4}\w+: |\Z)", re.MULTILINE | re.DOTALL)
_UNIT = re.compile(r"\[([^\]]+)\]")


@dataclass(frozen=True)
class ValuePath:
    """One value.

    Attributes:
        path: As `--set` takes it.
        value: In the scenario, as YAML and JSON write it.
        unit: SI unit, or empty.
        range: Limits or choices, or empty.
        default: What it is where a file does not name it, or empty where every file must.
        meaning: In words.
    """

    path: str
    value: str
    unit: str
    range: str
    default: str
    meaning: str


def value_paths(instance: Any) -> tuple[ValuePath, ...]:
    """The values of a pydantic model or dataclass, in the order of its file."""
    adapter = TypeAdapter(type(instance))
    root = adapter.json_schema()
    values = adapter.dump_python(instance, mode="json", by_alias=True)
    return tuple(_below(root, values, list(member_schemas(root, root, values)), (), {}))


def _below(
    root: Mapping[str, Any],
    node: Any,
    schemas: list[Schema],
    path: tuple[str, ...],
    about: Mapping[str, Any],
) -> Iterator[ValuePath]:
    """Values below `node`, which `schemas` describe; `about` is what its holder says of it."""
    if not (isinstance(node, dict) or (isinstance(node, list) and any(isinstance(x, dict) for x in node))) or not node:
        yield _leaf(node, schemas, path, about)
        return
    known = {k: v for schema in schemas for k, v in _ATTRIBUTE.findall(schema.get("description", ""))}
    for key, value in node.items() if isinstance(node, dict) else enumerate(node):
        fields = [field for schema in schemas for field in inner_schemas(schema, str(key))]
        below = [member for field in fields for member in member_schemas(field, root, value)]
        described = {"text": known.get(str(key), about.get("text", "")), "default": _default(fields)}
        yield from _below(root, value, below, (*path, str(key)), described)


def _default(fields: list[Schema]) -> str:
    found = [json.dumps(field["default"]) for field in fields if "default" in field]
    return found[0] if found and len(found[0]) < 30 else ""


def _leaf(node: Any, schemas: list[Schema], path: tuple[str, ...], about: Mapping[str, str]) -> ValuePath:
    text = " ".join(str(about.get("text", "")).split())
    unit = _UNIT.search(text)
    limits = next((shown for schema in schemas if (shown := _range(schema))), "")
    return ValuePath(
        ".".join(path),
        json.dumps(node, ensure_ascii=False),
        unit[1] if unit else "",
        limits,
        about.get("default", ""),
        re.sub(r" ?\[[^\]]+\]", "", text).rstrip("."),
    )


def _range(schema: Schema) -> str:
    if "enum" in schema:
        return " | ".join(map(str, schema["enum"]))
    if schema.get("type") == "array":
        parts = schema.get("prefixItems") or [schema.get("items", {})]
        return next((shown for part in parts if isinstance(part, Mapping) and (shown := _range(part))), "")
    low = [f"{schema[key]:g} {sign}" for key, sign in (("minimum", "<="), ("exclusiveMinimum", "<")) if key in schema]
    high = [f"{sign} {schema[key]:g}" for key, sign in (("maximum", "<="), ("exclusiveMaximum", "<")) if key in schema]
    return " ".join([*low, "x", *high]) if low or high else ""
