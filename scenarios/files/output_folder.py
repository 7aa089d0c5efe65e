"""Output that is there whole or not at all: written in a work folder of its file system, and moved in when complete.

    OUT/.tiago-twin.HEX.partial/{new, old, moving.json}       beside OUT, as .OUT.HEX.partial, where there is no OUT yet

Entries are moved in one by one, results last, so that a folder between two states lacks the file by which it is read.
`moving.json` lists them before the first is moved: what a killed command left is completed by the next one, or removed
where it was not complete. A work folder is locked while its process lives, so that a second command is refused. What a
user put into a folder stays; only folders of this program are replaced; links are moved, never followed.
"""

import fcntl
import glob
import json
import os
import re
import shutil
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from scenarios.files.errors import ScenarioError


@dataclass(frozen=True)
class Kind:
    """A kind of folder this program writes.

    Attributes:
        name: What to call it in a message.
        marker: The entry every folder of this kind holds.
        entries: Everything such a folder may hold at its top.
    """

    name: str
    marker: str
    entries: frozenset[str]


EVALUATION = frozenset({"evaluation.json", "evaluation.nc", "predictions", "score.json"})
REPORT = frozenset({"report.html", "figures", "refused.txt"})
RUN = Kind("run", "scenario.yaml", frozenset({"scenario.yaml", "dataset", "truth", "estimate"}) | EVALUATION | REPORT)
ESTIMATE = Kind(
    "estimate",
    "estimate.json",
    frozenset(
        {
            "estimate.json",
            "estimate.nc",
            "nominal.urdf",
            "calibrated.urdf",
            "zeros.yaml",
            "master_calibration.yaml",
            "parameters.csv",
            "record_next.yaml",
        }
        | REPORT
    ),
)
DATASET = Kind("dataset", "dataset.json", frozenset({"dataset.json", "nominal.urdf", "trials"}))
SIMULATED = Kind("simulated", "scenario.yaml", frozenset({"scenario.yaml", "dataset", "truth", "figures"}))

_INSIDE, _JOURNAL = ".tiago-twin", "moving.json"
_READ_BY = (
    "scenario.yaml", "dataset.json", "estimate.json", "evaluation.json", "score.json", "report.html",
)  # fmt: skip
_WRITTEN = RUN.entries | ESTIMATE.entries | DATASET.entries | {"truth.json", "twin.png"}


@contextmanager
def replacing(out: Path | str, kind: Kind) -> Iterator[Path]:
    """Yield an empty folder whose content takes the place of what `out` contained when the block ends well.

    Raises:
        ScenarioError: `out` is something that must not be overwritten, cannot be written, or another command writes it.
    """
    out = Path(out).resolve()
    check_replaceable(out, kind)
    with _working(out) as work:
        yield work / "new"
        _move_in(work, out, kind.entries)


@contextmanager
def updating(out: Path | str, names: Collection[str], marker: str | None = None) -> Iterator[Path]:
    """Yield an empty folder whose content goes into `out` when the block ends well; the rest of `out` stays.

    Args:
        out: The folder, made if there is none.
        names: Entries of `out` that this replaces; those not written again are removed.
        marker: The one of them that every such folder has: without it the others are somebody else's.

    Raises:
        ScenarioError: `out` is a file, cannot be written, holds such names of others, or another command writes it.
    """
    out = Path(out).resolve()
    if out.exists() and not out.is_dir():
        raise ScenarioError(f"{out}: is a file; name a folder")
    settle(out)
    strange = [] if marker is None or (out / marker).is_file() else [n for n in names if os.path.lexists(out / n)]
    if strange:
        raise ScenarioError(
            f"{out}: holds {', '.join(sorted(strange))} but no {marker}; move it away, or name another --out"
        )
    with _working(out) as work:
        yield work / "new"
        _move_in(work, out, names)


@contextmanager
def one_file(path: Path | str) -> Iterator[Path]:
    """Yield a new path beside a file, which takes its place when the block ends well.

    Raises:
        ScenarioError: It is a folder, or cannot be written.
    """
    path = Path(path)
    if path.is_dir():
        raise ScenarioError(f"{path}: is a folder; name a file")
    part = path.with_name(f".{path.name[:100]}.{os.urandom(4).hex()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.open("x").close()
        yield part
        os.replace(part, path)
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        if os.path.lexists(part):
            part.unlink()


def check_replaceable(out: Path, kind: Kind) -> None:
    """See that writing a folder of this kind at `out` loses no file of the user's.

    Raises:
        ScenarioError: It is a file, the folder one is in, or holds what this program does not write.
    """
    settle(out)
    if not out.exists():
        return
    if not out.is_dir():
        raise ScenarioError(f"{out}: is a file; name a folder")
    if Path.cwd().is_relative_to(out):
        raise ScenarioError(f"{out}: is the folder you are in; name one inside it, such as --out {kind.name}")
    present = {path.name for path in out.iterdir() if not _is_remnant(path.name)}
    foreign = sorted(present - kind.entries)
    if foreign or (present and kind.marker not in present):
        why = f"holds {', '.join(foreign[:5])}" if foreign else f"holds no {kind.marker}"
        raise ScenarioError(
            f"{out}: {why}, so it is not a {kind.name} folder of this program and is left alone; "
            "name another --out, or move away what is in it"
        )


def settle(out: Path | str) -> None:
    """Complete or remove what killed commands left of writing `out`.

    Raises:
        ScenarioError: A living command is writing it.
    """
    out = Path(out).resolve()
    ours = re.compile(r"\.[0-9a-f]{16}\.partial")
    for folder, name in ((out.parent, f".{out.name}"), (out, _INSIDE)):
        for found in folder.glob(f"{glob.escape(name)}.*.partial") if folder.is_dir() else ():
            if not ours.fullmatch(found.name.removeprefix(name)) or found.is_symlink() or not found.is_dir():
                continue
            with _held(found, out):
                _complete(found, out)
                shutil.rmtree(found, ignore_errors=True)


def settle_inputs(*places: Path | str) -> None:
    """Settle folders that are read, and those they lie in."""
    for place in places:
        settle(place)
        settle(Path(place).resolve().parent)


def _is_remnant(name: str) -> bool:
    """Whether it is a file or folder of this program that a killed process left half written."""
    return name.startswith(".") and name.endswith((".part", ".partial"))


@contextmanager
def locked(handle: int, place: Path) -> Iterator[None]:
    """Lock an open folder and close it at the end; the lock ends with the process, however that ends.

    Raises:
        ScenarioError: Another command is writing `place`.
    """
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise ScenarioError(f"{place}: another command is writing it; wait for it, or stop it") from error
        yield
    finally:
        os.close(handle)


@contextmanager
def _held(work: Path, out: Path) -> Iterator[None]:
    """Hold a work folder; the hold ends with the process, however that ends."""
    try:
        handle = os.open(work, os.O_RDONLY | os.O_NOFOLLOW)
    except OSError as error:
        raise ScenarioError(f"{work}: cannot be read: {error.strerror}; remove it") from error
    with locked(handle, out):
        yield


@contextmanager
def _working(out: Path) -> Iterator[Path]:
    """Yield a work folder in `out`, or beside it where there is none, with an empty folder `new`; remove it in the end.

    Parents that had to be made are removed too when nothing came into them.
    """
    settle(out)
    made = [parent for parent in out.parents if not parent.exists()]
    stem = out / _INSIDE if out.is_dir() else out.with_name(f".{out.name}")
    work = stem.with_name(f"{stem.name}.{os.urandom(8).hex()}.partial")
    try:
        try:
            work.parent.mkdir(parents=True, exist_ok=True)
            work.mkdir()
            (work / "new").mkdir()
        except OSError as error:
            raise ScenarioError(f"{out}: cannot be written: {error.strerror}") from error
        with _held(work, out):
            yield work
    finally:
        shutil.rmtree(work, ignore_errors=True)
        for parent in made:
            if parent.is_dir() and not any(parent.iterdir()):
                parent.rmdir()


def _move_in(work: Path, out: Path, names: Collection[str]) -> None:
    """Move what is in `new` to its place, and what `out` has of `names` away: all or nothing.

    What was in the way goes into `old`, and comes back from there when something interrupts.
    """
    new, old = work / "new", work / "old"
    if not out.exists():
        new.rename(out)
        return
    written = {path.name for path in new.iterdir()}
    moving = sorted({*written, *(name for name in names if os.path.lexists(out / name))}, key=_order)
    old.mkdir()
    (work / _JOURNAL).write_text(json.dumps({name: name in written for name in moving}), encoding="utf-8")
    try:
        _move(work, out, moving)
    except BaseException:
        for name in moving:
            if name in written and not (new / name).exists():
                (out / name).rename(new / name)
            if os.path.lexists(old / name):
                (old / name).rename(out / name)
        raise
    _keep_others(old, out)
    (work / _JOURNAL).unlink()


def _move(work: Path, out: Path, moving: Sequence[str]) -> None:
    """Away what is in the way, results first; then in what is new, results last."""
    for name in reversed(moving):
        if os.path.lexists(out / name) and not os.path.lexists(work / "old" / name):
            (out / name).rename(work / "old" / name)
    for name in moving:
        if os.path.lexists(work / "new" / name):
            (work / "new" / name).rename(out / name)


def _complete(work: Path, out: Path) -> None:
    """Go on where a killed command stopped moving."""
    try:
        listed: dict[str, bool] = json.loads((work / _JOURNAL).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return
    left = [name for name, written in listed.items() if (work / "new" / name).exists() or not written]
    _move(work, out, left)
    _keep_others(work / "old", out)
    (work / _JOURNAL).unlink()


def _keep_others(old: Path, out: Path) -> None:
    """Put back what somebody else put into folders that are replaced."""
    for root, _, files in os.walk(old):
        for name in files:
            place = out / (Path(root) / name).relative_to(old)
            mine = name in _WRITTEN or name.endswith(".nc") or len(place.relative_to(out).parts) == 1
            if not mine and not os.path.lexists(place):
                place.parent.mkdir(parents=True, exist_ok=True)
                (Path(root) / name).rename(place)


def _order(name: str) -> tuple[int, str]:
    """Files by which a folder is read come last."""
    return (_READ_BY.index(name) if name in _READ_BY else -1), name
