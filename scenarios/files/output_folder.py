"""Output that is there whole or not at all: written beside its place, and moved in when it is complete.

A folder is replaced only when it is empty or one of ours: it holds its marker and nothing this program does not
write, so that no file of the user's is ever lost. Whatever interrupts the work, exceptions and Ctrl-C included,
the new files are removed and the old ones stay.
"""

import os
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
            "master_calibration.yaml",
            "parameters.csv",
            "record_next.yaml",
        }
        | REPORT
    ),
)
DATASET = Kind("dataset", "dataset.json", frozenset({"dataset.json", "nominal.urdf", "trials"}))


@contextmanager
def replacing(out: Path | str, kind: Kind) -> Iterator[Path]:
    """Yield an empty folder which takes the place of `out` when the block ends well.

    Raises:
        ScenarioError: `out` is something that must not be overwritten, or cannot be written.
    """
    out = Path(out).resolve()
    check_replaceable(out, kind)
    with _beside(out) as work:
        yield work / "new"
        _move([(work / "new", out)], work)


@contextmanager
def updating(out: Path | str, names: Collection[str]) -> Iterator[Path]:
    """Yield an empty folder whose content goes into `out` when the block ends well; the rest of `out` stays.

    Args:
        out: The folder, made if there is none.
        names: Entries of `out` that this replaces; those not written again are removed.

    Raises:
        ScenarioError: `out` is a file, or cannot be written.
    """
    out = Path(out).resolve()
    if out.exists() and not out.is_dir():
        raise ScenarioError(f"{out}: is a file; name a folder")
    with _beside(out) as work:
        new = work / "new"
        yield new
        if not out.exists():
            _move([(new, out)], work)
        else:
            stale = [name for name in names if (out / name).exists()]
            moving = sorted({*stale, *(path.name for path in new.iterdir())})
            _move([(new / name, out / name) for name in moving], work)


def check_replaceable(out: Path, kind: Kind) -> None:
    """See that writing a folder of this kind at `out` loses no file of the user's.

    Raises:
        ScenarioError: It is a file, the folder one is in, or holds what this program does not write.
    """
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


def _is_remnant(name: str) -> bool:
    """Whether it is a file or folder of this program that a killed process left half written."""
    return name.startswith(".") and name.endswith((".part", ".partial"))


@contextmanager
def _beside(out: Path) -> Iterator[Path]:
    """Yield a work folder in the parent of `out`, with an empty folder `new` in it; remove it in the end.

    Parents that had to be made are removed too when nothing came into them.
    """
    made = [parent for parent in out.parents if not parent.exists()]
    work = out.with_name(f".{out.name}.{os.urandom(4).hex()}.partial")
    try:
        try:
            (work / "new").mkdir(parents=True)
        except OSError as error:
            raise ScenarioError(f"{out}: cannot be written: {error.strerror}") from error
        yield work
    finally:
        shutil.rmtree(work, ignore_errors=True)
        for parent in made:
            if parent.is_dir() and not any(parent.iterdir()):
                parent.rmdir()


def _move(pairs: Sequence[tuple[Path, Path]], work: Path) -> None:
    """Move each new path to its place, all or none; a new path that is not there only removes the old one.

    What was in the way goes into `work`, and comes back from there when something interrupts.
    """
    olds = [work / f"old{i}" for i in range(len(pairs))]
    written = [new.exists() for new, _ in pairs]
    try:
        for (new, place), old in zip(pairs, olds, strict=True):
            if place.exists():
                place.rename(old)
            if new.exists():
                new.rename(place)
    except BaseException:
        for (new, place), old, was_written in zip(pairs, olds, written, strict=True):
            if was_written and not new.exists():
                place.rename(new)
            if old.exists():
                old.rename(place)
        raise
