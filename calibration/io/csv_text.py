"""A CSV file as named columns of numbers; what is wrong in it is told by line and column."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from calibration.errors import InputError


@dataclass(frozen=True)
class CsvText:
    """Cells of a file: `header` names the columns, `cells` (n, c) are as written."""

    path: Path
    header: tuple[str, ...]
    cells: np.ndarray

    def numbers(self, columns: Sequence[str], factor: float = 1.0, gaps: bool = False) -> np.ndarray:
        """Values (n, len(columns)) times `factor`; an empty cell is NaN where `gaps` are allowed.

        Raises:
            InputError: A column is not there, or a cell is no number.
        """
        chosen = self.cells[:, [self.index(name) for name in columns]]
        try:
            return np.asarray(np.where(chosen == "", "nan", chosen) if gaps else chosen, dtype=float) * factor
        except ValueError as error:
            row, k, text = next((r, k, t) for (r, k), t in np.ndenumerate(chosen) if not _is_number(t, gaps))
            what = f"{str(text)!r} is no number" if text else "the cell is empty"
            raise self.error(row, columns[k], f"{what}; only an occluded marker may be left out") from error

    def seconds(self, column: str, unit: str) -> np.ndarray:
        """Times (n,) [s] of a column in `s`, `ms` or `utc` (since the midnight before the first row)."""
        if unit != "utc":
            return self.numbers([column], 1e-3 if unit == "ms" else 1.0)[:, 0]
        index, stamps = self.index(column), []
        for row, text in enumerate(self.cells[:, index]):
            try:
                stamps.append(datetime.fromisoformat(text.replace("_", "T")).replace(tzinfo=None))
            except ValueError as error:
                message = f"{text!r} is no UTC stamp such as 2023-09-20_16:40:52.540797"
                raise self.error(row, column, message) from error
        midnight = stamps[0].replace(hour=0, minute=0, second=0, microsecond=0)
        return np.array([(stamp - midnight).total_seconds() for stamp in stamps])

    def index(self, column: str) -> int:
        """Place of a column.

        Raises:
            InputError: There is none of that name.
        """
        if column not in self.header:
            known = ", ".join(self.header)
            raise InputError(
                f"{self.path}:1:1", f"{column}: no such column; the file has {known}; correct the mapping file"
            )
        return self.header.index(column)

    def error(self, row: int, column: str, message: str) -> InputError:
        """An error at a cell."""
        return InputError(f"{self.path}:{row + 2}:{self.index(column) + 1}", f"{column}: {message}")


def read_text(path: Path) -> CsvText:
    """Read a file with one header line.

    Raises:
        InputError: It cannot be read, has no header or no rows, names a column twice, or a row is of another length.
    """
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            rows = [row for row in csv.reader(stream) if row]
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(path, f"is no CSV text ({error}); export it again") from error
    if len(rows) < 2:
        raise InputError(f"{path}:1:1", "no rows below the header; export the file again")
    header = tuple(name.strip() for name in rows[0])
    if all(_is_number(name, gaps=False) for name in header[1:]):
        raise InputError(f"{path}:1:1", "the first line holds numbers; write a header line that names the columns")
    twice = sorted({name for name in header if header.count(name) > 1})
    if twice:
        raise InputError(f"{path}:1:{header.index(twice[0]) + 1}", f"columns named more than once: {twice}")
    for line, row in enumerate(rows[1:], start=2):
        if len(row) != len(header):
            message = f"{len(row)} cells, the header has {len(header)}: truncated or damaged; export the file again"
            raise InputError(f"{path}:{line}:{len(row)}", message)
    return CsvText(path, header, np.char.strip(np.array(rows[1:], dtype=str)))


def _is_number(text: str, gaps: bool) -> bool:
    if not text:
        return gaps
    try:
        float(text)
    except ValueError:
        return False
    return True
