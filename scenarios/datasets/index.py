"""The index of a collection: one row a run, as CSV.

    id, split, status, reason, sha256, simulated_s, bytes, then the figures of the runs

`status` is ok, failed (its simulation or fit stopped, with the reason) or killed (it took its worker down). Nothing in
it depends on how long the work took or who did it.
"""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from scenarios.datasets.run_spec import Magnitude

Status = Literal["ok", "failed", "killed"]
_FIXED = ("id", "split", "status", "reason", "sha256", "bytes")
_SPLITS = ("train",) * 8 + ("validation", "test")


@dataclass(frozen=True)
class Row:
    """One run in the index.

    Attributes:
        id: Its number.
        status: How it ended.
        reason: Why it did not end well; empty where it did.
        sha256: Of its sorted files; empty where it has none.
        bytes: Of its files together.
        magnitudes: Its figures.
    """

    id: int
    status: Status
    reason: str = ""
    sha256: str = ""
    bytes: int = 0
    magnitudes: tuple[Magnitude, ...] = ()

    @property
    def split(self) -> str:
        """Part of the collection it belongs to: of each ten runs eight train, one validation, one test."""
        return _SPLITS[self.id % len(_SPLITS)]


def write_index(path: Path, rows: Sequence[Row]) -> None:
    """Write index.csv, whole or not at all."""
    names = list(dict.fromkeys(m.name for row in rows for m in row.magnitudes))
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow([*_FIXED, *names])
    for row in sorted(rows, key=lambda r: r.id):
        values = {m.name: repr(m.value) for m in row.magnitudes}
        fixed = [row.id, row.split, row.status, row.reason, row.sha256, row.bytes]
        table.writerow([*fixed, *(values.get(name, "") for name in names)])
    write_whole(path, text.getvalue())


def read_index(path: Path) -> tuple[Row, ...]:
    """Rows of index.csv."""
    with path.open(encoding="utf-8", newline="") as file:
        return tuple(_row(entry) for entry in csv.DictReader(file))


def _row(entry: dict[str, str]) -> Row:
    figures = (Magnitude(name, float(v)) for name, v in entry.items() if name not in _FIXED and v)
    status: Status = "ok" if entry["status"] == "ok" else "failed" if entry["status"] == "failed" else "killed"
    return Row(int(entry["id"]), status, entry["reason"], entry["sha256"], int(entry["bytes"]), tuple(figures))


def write_whole(path: Path, text: str) -> None:
    """Write a text file so that whoever looks sees the old one or the new one."""
    beside = path.with_name(f".{path.name}.partial")
    beside.write_text(text, encoding="utf-8")
    beside.replace(path)
