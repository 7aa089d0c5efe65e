"""A hostile case: a laboratory that is spoilt, a command, and what must become of it."""

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.hostile.rows.child import Outcome, command

REFUSED = (2,)
"""Exit codes of wrong input."""


@dataclass(frozen=True)
class Case:
    """A row of a table.

    Attributes:
        name: What is wrong, in a few words.
        spoil: Makes it so in a copy of the laboratory: folders data, run, csv, c3d, bag; see `laboratory`.
        arguments: The command; `out` is where it may write.
        says: Words of its message, any of them between `|`.
        codes: Exit codes allowed.
        outside: Whether files may be left beside `out`.
        slow: Whether it is left to `make slow`.
        group: Heading in docs/reliability.md.
    """

    name: str
    spoil: Callable[[Path], None]
    arguments: str
    says: str = ""
    codes: tuple[int, ...] = REFUSED
    slow: bool = False
    group: str = ""


@dataclass(frozen=True)
class Judged:
    """A case that was tried.

    Attributes:
        case: The row.
        outcome: What the command did.
        wrong: What it must not have done; empty where all is well.
    """

    case: Case
    outcome: Outcome
    wrong: tuple[str, ...]


def judged(case: Case, folder: Path) -> Judged:
    """Spoil a laboratory, run the command in it and judge the outcome."""
    case.spoil(folder)
    before = _files(folder)
    outcome = command(case.arguments.split(" "), folder)
    after = _files(folder)
    changed = sorted(p for p in before.keys() | after.keys() if before.get(p) != after.get(p) and not _ours(p))
    wrong = list(outcome.faults)
    if changed:
        wrong.append(f"outside: {changed[:3]}")
    if outcome.code not in case.codes:
        wrong.append(f"exit {outcome.code}, not {case.codes}")
    if case.says and not any(words in outcome.output for words in case.says.split("|")):
        wrong.append(f"does not say {case.says!r}")
    left = [p for p in after if outcome.code == 2 and ".partial" in p and p not in before]
    if left:
        wrong.append(f"left: {left[:3]}")
    return Judged(case, outcome, tuple(wrong))


def edit(path: str, change: Callable[[dict], None]) -> Callable[[Path], None]:
    """Spoil a JSON file of the laboratory."""

    def spoil(folder: Path) -> None:
        content = json.loads((folder / path).read_text())
        change(content)
        (folder / path).write_text(json.dumps(content))

    return spoil


def text(path: str, content: str | bytes) -> Callable[[Path], None]:
    """Put other content into a file."""

    def spoil(folder: Path) -> None:
        (folder / path).unlink(missing_ok=True)
        (folder / path).write_bytes(content.encode("utf-8", "surrogatepass") if isinstance(content, str) else content)

    return spoil


def put(path: str, *keys: str | int, value: object) -> Callable[[Path], None]:
    """Put a value into a JSON file, at the end of a way of keys."""

    def change(content: dict) -> None:
        node = content
        for key in keys[:-1]:
            node = node[key]
        node[keys[-1]] = value

    return edit(path, change)


def replaced(path: str, old: str, new: str, count: int = 1) -> Callable[[Path], None]:
    """Replace words of a text file; they must be there."""

    def spoil(folder: Path) -> None:
        found = (folder / path).read_text()
        assert old in found, (path, old)
        (folder / path).write_text(found.replace(old, new, count))

    return spoil


def pipe(path: str) -> Callable[[Path], None]:
    """Put a pipe in place of a file."""

    def spoil(folder: Path) -> None:
        (folder / path).unlink()
        os.mkfifo(folder / path)

    return spoil


def linked(path: str, to: str) -> Callable[[Path], None]:
    """Put a link in place of a file."""

    def spoil(folder: Path) -> None:
        (folder / path).unlink()
        (folder / path).symlink_to(to)

    return spoil


def _ours(path: str) -> bool:
    return path.partition("/")[0] in ("out", ".config", ".cache")


def _files(folder: Path) -> dict[str, tuple[int, int]]:
    found = {}
    for root, folders, files in os.walk(folder):
        for name in (*files, *folders):
            path = Path(root) / name
            about = path.lstat()
            is_folder = path.is_dir() and not path.is_symlink()
            found[str(path.relative_to(folder))] = (0, 0) if is_folder else (about.st_size, about.st_mtime_ns)
    return found
