"""A table of measured marker bodies: one CSV row a marker, coordinates in its link's frame.

body,link,marker,x,y,z        [m]
"""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.untrusted import check_file
from scenarios.files.errors import ScenarioError

if TYPE_CHECKING:
    from calibration.recording.schema import Body

NAME = "markers.csv"
HEADER = ("body", "link", "marker", "x", "y", "z")
_LONGEST = 1000  # characters of a first line


def is_drawing(path: Path) -> bool:
    """Whether a file is such a table, by its header."""
    try:
        if not path.is_file():
            return False
        with path.open(encoding="utf-8-sig") as stream:
            return tuple(name.strip() for name in stream.readline(_LONGEST).split(",")) == HEADER
    except (OSError, UnicodeDecodeError):
        return False


def bodies(path: Path) -> list[dict[str, Any]]:
    """The bodies as a mapping has them.

    Raises:
        ScenarioError: The table cannot be read; the first wrong line.
    """
    if not is_drawing(path):
        raise ScenarioError(f"{path}: bodies: no such table; its header is {','.join(HEADER)}")
    found: dict[tuple[str, str], list[dict[str, Any]]] = {}
    check_file(path, 2**20)
    with path.open(encoding="utf-8-sig", newline="") as stream:
        for line, row in enumerate(csv.DictReader(stream), start=2):
            try:
                xyz = [float(row[axis]) for axis in "xyz"]
            except (TypeError, ValueError) as error:
                raise ScenarioError(f"{path}:{line}: x, y, z: {error}; write metres in the link's frame") from error
            found.setdefault((row["body"], row["link"]), []).append({"name": row["marker"], "xyz": xyz})
    return [{"name": body, "link": link, "markers": markers} for (body, link), markers in found.items()]


def names(path: Path) -> tuple[tuple[str, str, tuple[str, ...]], ...]:
    """Body, link and marker names of the table."""
    return tuple((b["name"], b["link"], tuple(m["name"] for m in b["markers"])) for b in bodies(path))


def write(path: Path, described: "Sequence[Body]") -> None:
    """Write the bodies that have no placement of their own."""
    drawn = [b for b in described if b.markers and not any(b.placement)]
    rows = [(b.name, b.link, m.name, *m.xyz) for b in drawn for m in b.markers]
    text = "\n".join(",".join(map(str, row)) for row in (HEADER, *rows))
    path.write_text(text + "\n", encoding="utf-8", newline="\n")
