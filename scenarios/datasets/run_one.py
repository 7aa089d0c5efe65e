"""One run: made beside its place, moved in when it is complete, left alone when it is already right."""

import hashlib
import json
import secrets
import shutil
from dataclasses import asdict
from pathlib import Path

from scenarios.datasets.index import Row
from scenarios.datasets.run_spec import Magnitude, Order
from scenarios.steps.threads import one_blas_thread

MANIFEST = "run.json"
PARTIAL = ".partial"


def perform(order: Order) -> Row:
    """Make a run, unless it is there and its files are what its manifest says.

    Returns:
        Its row; `failed` where the simulation or the calibration says that there is no result.

    Raises:
        OSError: The files cannot be written.
    """
    from calibration.errors import CalibrationError
    from twin.errors import TwinError

    there = found(order)
    if there is not None:
        return there
    work = order.place.with_name(f".{order.place.name}.{secrets.token_hex(4)}{PARTIAL}")
    try:
        work.mkdir(parents=True)
        with one_blas_thread():
            magnitudes = order.produce(order.resolved(), work)
        row = Row(order.id, "ok", "", digest(work), size(work), magnitudes)
        (work / MANIFEST).write_text(json.dumps({"order": order.digest} | asdict(row)) + "\n", encoding="utf-8")
        _move_in(work, order.place)
    except (TwinError, CalibrationError) as error:
        return Row(order.id, "failed", " ".join(str(error).split()))
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return row


def found(order: Order) -> Row | None:
    """Row of a run that is already there; None where it is not, belongs to another order, or its files changed."""
    try:
        content = json.loads((order.place / MANIFEST).read_text(encoding="utf-8"))
        figures = tuple(Magnitude(*pair) for pair in content.pop("magnitudes"))
        ordered = content.pop("order")
        row = Row(**content, magnitudes=figures)
    except (OSError, ValueError, TypeError, KeyError):
        return None
    return row if (ordered, row.sha256) == (order.digest, digest(order.place)) else None


def digest(folder: Path) -> str:
    """Hex sha256 over the names and bytes of the sorted files of a run, its manifest apart."""
    total = hashlib.sha256()
    for path in _files(folder):
        total.update(path.relative_to(folder).as_posix().encode())
        total.update(hashlib.sha256(path.read_bytes()).digest())
    return total.hexdigest()


def size(folder: Path) -> int:
    """Bytes of the files of a run, its manifest apart."""
    return sum(path.stat().st_size for path in _files(folder))


def _files(folder: Path) -> list[Path]:
    return sorted(p for p in folder.rglob("*") if p.is_file() and p != folder / MANIFEST)


def _move_in(work: Path, place: Path) -> None:
    """Put the complete run in its place; what is in the way is not right and goes."""
    if place.exists():
        shutil.rmtree(place)
    work.rename(place)
