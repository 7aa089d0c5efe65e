"""Files of others as text, JSON, YAML and URDF, within bounds: what a file costs is known before it is read.

A regular file of at most so many bytes; no deeper and, its aliases written out, no larger than a person writes; no
key twice. The libraries behind (ruamel.yaml, urdfdom) recurse, expand and crash without such bounds.
"""

import json
import math
import stat
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from calibration.errors import InputError

MOST_BYTES = 64 * 2**20
"""Of a text file [B]; JSON of this size is read within some seconds."""

_YAML_BYTES = 2**18  # [B]: ruamel.yaml reads some 50 kB a second
_YAML_NODES = 100_000  # values, aliases written out
_DEPTH = 60  # of lists and mappings within each other, and of elements
_LINKS = 500  # of a robot
_LEAST = {"mass value": 0.0, "axis length": 1e-6}  # numbers of a robot that have a sign
_FINDINGS = 20  # shown of one file


def check_file(path: Path, most: int = MOST_BYTES, hint: str = "") -> None:
    """See that a path is a regular file of bounded size.

    Raises:
        InputError: It is not.
    """
    try:
        found = path.stat()
    except FileNotFoundError as error:
        raise InputError(path, f"no such file{hint and f'; {hint}'}") from error
    except (OSError, ValueError) as error:
        raise InputError(path, f"cannot be read ({getattr(error, 'strerror', None) or error})") from error
    if not stat.S_ISREG(found.st_mode):
        what = "is a folder" if stat.S_ISDIR(found.st_mode) else "is no regular file"
        raise InputError(path, f"{what}; name a file")
    if found.st_size > most:
        raise InputError(path, f"has {found.st_size / 2**20:.3g} MB; at most {most / 2**20:.3g} MB are read")


def read_text(path: Path | str, most: int = MOST_BYTES, hint: str = "") -> str:
    """Text of a file in UTF-8, a byte order mark left out.

    Args:
        path: The file.
        most: Its largest size [B].
        hint: What to do where there is none.

    Raises:
        InputError: It cannot be read, or is too large.
    """
    path = Path(path)
    check_file(path, most, hint)
    try:
        return path.read_bytes().decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise InputError(path, f"not UTF-8 text (byte {error.start})") from error
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})") from error


def json_of(text: str, path: Path | str) -> Any:
    """Values of a JSON text; `path` is for messages.

    Raises:
        InputError: It is no JSON, nested too deeply, or has a key twice.
    """
    try:
        return json.loads(text, object_pairs_hook=_once)
    except json.JSONDecodeError as error:
        raise InputError(f"{path}:{error.lineno}:{error.colno}", f"broken JSON: {error.msg}") from error
    except RecursionError as error:
        raise InputError(path, "broken JSON: nested too deeply") from error
    except ValueError as error:
        raise InputError(path, f"broken JSON: {_short(error)}") from error


def read_json(path: Path, hint: str = "") -> Any:
    """Values of a JSON file.

    Raises:
        InputError: As `read_text` and `json_of`.
    """
    return json_of(read_text(path, hint=hint), path)


def yaml_of(text: str, path: Path | str, load: Callable[[str], Any] | None = None) -> Any:
    """Values of a YAML text, by a loader of ruamel.yaml, the safe one unless given; `path` is for messages.

    Raises:
        InputError: It is no YAML, or too large.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    try:
        if len(text) > _YAML_BYTES:
            raise InputError(path, f"has {len(text) / 2**20:.3g} MB of YAML; at most 0.25 MB is read")
        _check_size(text, path)
        return (load or YAML(typ="safe", pure=True).load)(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"{path}:{mark.line + 1}:{mark.column + 1}" if mark else path
        message = ", ".join(part for part in (error.context, error.problem) if part)
        raise InputError(place, f"not YAML: {message}") from error
    except RecursionError as error:
        raise InputError(path, "not YAML: nested too deeply") from error
    except (YAMLError, ValueError, TypeError, AttributeError) as error:  # dates and numbers that are none
        raise InputError(path, f"not YAML: {_short(error)}") from error


def findings(error: ValidationError, whole: str) -> str:
    """What pydantic found, in one line: places, messages; the first of many."""
    found = error.errors(include_url=False, include_context=False, include_input=False)
    lines = [f"{'.'.join(map(str, e['loc'])) or whole}: {e['msg']}" for e in found[:_FINDINGS]]
    more = [f"and {len(found) - _FINDINGS} more"] if len(found) > _FINDINGS else []
    return "; ".join([*lines, *more])


def checked_urdf(text: str, path: Path | str) -> str:
    """A URDF whose links are a tree of bounded size, with finite numbers, masses not negative and axes not zero.

    Raises:
        InputError: It is not such a text; the libraries that read it may crash on others.
    """
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError(path, "not a URDF: has a document type; remove it")
    try:
        robot = ET.fromstring(text)
    except (ET.ParseError, RecursionError, ValueError) as error:
        raise InputError(path, f"not a URDF: {_short(error)}") from error
    links = [str(link.get("name")) for link in robot.iter("link")]
    if len(links) > _LINKS:
        raise InputError(path, f"not a URDF of a robot: {len(links)} links; at most {_LINKS} are read")
    parent = {}
    for joint in robot.findall("joint"):
        ends = [str(found.get("link")) for end in ("parent", "child") if (found := joint.find(end)) is not None]
        if len(ends) != 2 or not set(ends) <= set(links) or ends[1] in parent:
            raise InputError(
                path, f"not a URDF: joint {joint.get('name')!r} joins {ends}, which makes no tree of links"
            )
        parent[ends[1]] = ends[0]
    roots = [link for link in links if link not in parent]
    if len(roots) != 1 or len(set(links)) != len(links) or not _ends(parent, links):
        raise InputError(path, f"not a URDF: its links are no tree with one root (roots {roots[:5]})")
    for place, value in _numbers(robot):
        if not _LEAST.get(place, -1e9) <= value < 1e9:
            raise InputError(path, f"not a URDF of a robot: {place} is {value:g}")
    return text


def _ends(parent: dict[str, str], links: list[str]) -> bool:
    """Whether every way from a link to its parent ends."""
    for link in links:
        at, steps = link, 0
        while at in parent and steps <= len(links):
            at, steps = parent[at], steps + 1
        if steps > len(links):
            return False
    return True


def _numbers(robot: ET.Element) -> Iterator[tuple[str, float]]:
    """Every number of places, axes, masses, inertias and limits; NaN for what is none."""
    for tag in ("origin", "axis", "mass", "inertia", "limit"):
        for element in robot.iter(tag):
            for name, words in element.attrib.items():
                for word in words.split():
                    try:
                        yield f"{tag} {name}", float(word)
                    except ValueError:
                        yield f"{tag} {name}", float("nan")
    for axis in robot.iter("axis"):
        yield "axis length", math.hypot(*map(float, axis.get("xyz", "1 0 0").split()))


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"{next(n for k, n in enumerate(names) if n in names[:k])!r} is there twice")
    return found


def _check_size(text: str, path: Path | str) -> None:
    """Refuse YAML that is nested too deeply, or too large once its aliases are written out."""
    if "*" not in text and max(text.count("["), text.count("{"), text.count("- - ")) < _DEPTH:
        return
    from ruamel.yaml import YAML
    from ruamel.yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent, ScalarEvent

    sizes: dict[str, int] = {}
    open_: list[list] = [["", 0]]
    for event in YAML(typ="safe", pure=True).parse(text):
        size = 0
        if isinstance(event, CollectionStartEvent):
            open_.append([event.anchor or "", 1])
        elif isinstance(event, CollectionEndEvent):
            anchor, size = open_.pop()
            sizes[anchor] = size
        elif isinstance(event, AliasEvent):
            if any(anchor == event.anchor for anchor, _ in open_):
                raise InputError(path, f"not YAML of values: the alias *{event.anchor} is within itself")
            size = sizes.get(str(event.anchor), 1)
        elif isinstance(event, ScalarEvent):
            size = 1
        open_[-1][1] += size
        if len(open_) > _DEPTH or open_[-1][1] > _YAML_NODES:
            raise InputError(path, "not YAML of a person: nested too deeply, or its aliases stand for too many values")


def _short(error: BaseException) -> str:
    return " ".join(str(error).split())[:160]
