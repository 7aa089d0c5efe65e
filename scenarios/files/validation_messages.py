"""From pydantic's errors to the lines a person reads: where in the file, what is possible, what was found."""

import difflib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from pydantic import TypeAdapter, ValidationError
from pydantic.errors import PydanticInvalidForJsonSchema
from ruamel.yaml.comments import CommentedMap

from scenarios.files.overrides import Override, explaining, place

UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")
MISSING = ("missing", "missing_argument", "missing_keyword_only_argument")
"""What pydantic calls these two in models and in dataclasses."""

UNKNOWN_NAME = "unknown_name"
"""What `twin` calls a name that nothing of its kind has."""

OF_KEY = "[key]"
"""What pydantic puts behind the key of a mapping when the key is wrong."""

MOST_FINDINGS = 100
"""Of one file that are shown."""

_PLAIN = (
    ("Input should be", "must be"),
    ("less than or equal to", "at most"),
    ("greater than or equal to", "at least"),
)
"""Words of pydantic's, and ours."""

LONGEST_VALUE = 60
"""Characters of a found value that are shown."""


@dataclass(frozen=True)
class Source:
    """What was validated, and where it came from.

    Attributes:
        file: The file's name.
        tree: The file as loaded, with the line and column of every value.
        values: The plain values validated, overrides included.
        overrides: What was put in beside the file.
    """

    file: str
    tree: CommentedMap
    values: dict[str, Any]
    overrides: Sequence[Override] = ()

    def findings(self, error: ValidationError, adapter: TypeAdapter[Any], above: tuple[str, ...] = ()) -> list[str]:
        """Return one line per finding, in the order of the file, then those about overrides in theirs.

        Args:
            error: What pydantic found.
            adapter: What it validated against; it knows the names that are possible.
            above: Path of what was validated within `values`.
        """
        placed = []
        details = error.errors(include_url=False)
        wrong = {d["loc"][:-1] for d in details if d["loc"] and d["loc"][-1] == OF_KEY}
        details = [d for d in details if d["type"] not in MISSING or d["loc"][:-1] not in wrong]
        for detail in details[:MOST_FINDINGS]:
            path = _path(self.values, (*above, *detail["loc"]), detail["type"])
            known = _fields(adapter, self.values, above, path[:-1]) if detail["type"] in UNKNOWN else []
            text = ": ".join(part for part in (".".join(path), _message(detail, path, known)) if part)
            of_key = detail["type"] in UNKNOWN + MISSING or detail["loc"][-1:] == (OF_KEY,)
            rank, line, column, where = self._where(path, path[:-1] if detail["type"] in MISSING else path, of_key)
            placed.append((rank, line, column, f"{where}{text}"))
        more = [f"{self.file}: and {len(details) - MOST_FINDINGS} more"] if len(details) > MOST_FINDINGS else []
        return [text for *_, text in sorted(placed, key=lambda found: found[:3])] + more

    def _where(self, path: tuple[str, ...], holder: tuple[str, ...], of_key: bool) -> tuple[int, int, int, str]:
        """The place of `path`: 0 for this file or the number of an override from 1, line, column, and all in words.

        Args:
            path: What is wrong.
            holder: What had to be there for it: its mapping, when it is missing.
            of_key: Its name is wrong, not its value.
        """
        *_, in_file = place(self.tree, holder, of_key=False)
        number = explaining(self.overrides, holder, in_file)
        if number is not None:
            line, column, where = self.overrides[number].where(path, of_key)
            return number + 1, line, column, where
        line, column, _ = place(self.tree, path, of_key)
        return 0, line, column, f"{self.file}:{line + 1}:{column + 1}: "


def _path(values: Any, location: Sequence[str | int], kind: str) -> tuple[str, ...]:
    """Return a location without the names of union members, which pydantic adds and no file holds."""
    path: list[str] = []
    node: Any = values
    for depth, step in enumerate(location):
        last = depth == len(location) - 1
        known = range(len(node)) if isinstance(node, list) else node
        if isinstance(node, (dict, list)) and step in known:
            path.append(str(step))
            node = node[step]  # type: ignore[index]
        elif last and kind in MISSING:
            path.append(str(step))
    return tuple(path)


def _message(detail: Mapping[str, Any], path: Sequence[str], known: Sequence[str]) -> str:
    """What is wrong and, for a wrong name, what is possible."""
    if detail["type"] in MISSING:
        return "missing"
    if detail["type"] == UNKNOWN_NAME:
        name, context = detail["input"], detail["ctx"]
        return _unknown(f"no {context['kind']} named {name}", name, context["known"].split(", "))
    if detail["type"] in UNKNOWN:
        return _unknown("unknown field", path[-1], known)
    message = detail["msg"].removeprefix("Value error, ").removeprefix("Assertion failed, ")
    for theirs, ours in _PLAIN:
        message = message.replace(theirs, ours)
    return f"{message} (got {_shown(detail['input'])})"


def _unknown(what: str, name: str, known: Sequence[str]) -> str:
    close = difflib.get_close_matches(name, known, n=1)
    hint = f"; did you mean {close[0]}?" if close else ""
    return f"{what}{hint}" + (f" (known here: {', '.join(known)})" if known else "")


def _shown(value: Any) -> str:
    if isinstance(value, Mapping):
        return "a mapping"
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]}..."


def _fields(adapter: TypeAdapter[Any], values: Any, above: Sequence[str], path: Sequence[str]) -> list[str]:
    """Return the field names possible in the mapping at `path`, as far as the types show."""
    try:
        root = _schema(adapter)
    except PydanticInvalidForJsonSchema:
        return []
    node = values
    for step in above:
        node = node[step]
    schemas = list(member_schemas(root, root, node))
    for step in path[len(above) :]:
        node = node[int(step)] if isinstance(node, list) else node[step]
        schemas = [
            member
            for schema in schemas
            for inner in inner_schemas(schema, step)
            for member in member_schemas(inner, root, node)
        ]
    return sorted({name for schema in schemas for name in schema.get("properties", {})})


@lru_cache(maxsize=4)
def _schema(adapter: TypeAdapter[Any]) -> dict[str, Any]:
    return adapter.json_schema()


def inner_schemas(schema: Mapping[str, Any], step: str) -> Iterator[Mapping[str, Any]]:
    """Schemas of one field, or of one item, of what `schema` describes."""
    prefix = schema.get("prefixItems", [])
    if step in schema.get("properties", {}):
        yield schema["properties"][step]
    elif step.isdecimal() and int(step) < len(prefix):
        yield prefix[int(step)]
    else:
        yield from (schema[rest] for rest in ("items", "additionalProperties") if isinstance(schema.get(rest), Mapping))


def member_schemas(schema: Mapping[str, Any], root: Mapping[str, Any], node: Any) -> Iterator[Mapping[str, Any]]:
    """The schemas a schema stands for: references and unions resolved, members of another kind than `node` left out."""
    if "$ref" in schema:
        yield from member_schemas(root["$defs"][schema["$ref"].rsplit("/", 1)[-1]], root, node)
        return
    for union in ("anyOf", "oneOf", "allOf"):
        for member in schema.get(union, []):
            yield from member_schemas(member, root, node)
    kinds = {name: field["const"] for name, field in schema.get("properties", {}).items() if "const" in field}
    if isinstance(node, Mapping) and all(node.get(name, kind) == kind for name, kind in kinds.items()):
        yield schema
    elif not isinstance(node, Mapping):
        yield schema
