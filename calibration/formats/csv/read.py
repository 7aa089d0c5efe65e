"""CSV files of one trial, read by the tables of the mapping: samples on a clock, or static postures.

A CSV file as named columns of numbers; what is wrong in it is identified by line and column.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import reduce
from pathlib import Path

import numpy as np

from calibration.errors import InputError
from calibration.formats.mapping.channels import Joints, Markers, Means, Plates, Recorded
from calibration.formats.mapping.layouts import ANGLES, LENGTHS, MOMENTS, CsvTable, PlateChannels, PoseChannels
from calibration.formats.mapping.plate_convention import checked_against_cop, to_action
from calibration.formats.mapping.poses import AXES, marker_names, marker_sigma, markers_at
from calibration.recording.schema import Plate, Setup
from calibration.recording.trial import check_times
from calibration.untrusted import check_file

_UNITS = ANGLES | LENGTHS
_MOST_BYTES, _MOST_COLUMNS = 128 * 2**20, 2000  # [B] of a file; its cells take some ten times as much while it is read
_LARGEST = 1e15  # of a number


def read_csv(files: Sequence[Path], tables: Sequence[CsvTable], setup: Setup) -> Recorded:
    """What the files of one trial hold; each is of the table with the longest matching suffix.

    Raises:
        InputError: Something in a file is not as the mapping says.
    """
    return reduce(Recorded.with_channels_of, (_read(path, table_of(path, tables), setup) for path in files))


def table_of(path: Path, tables: Sequence[CsvTable]) -> CsvTable:
    """The table a file belongs to.

    Raises:
        InputError: None has its suffix.
    """
    fitting = [t for t in tables if path.name.endswith(t.suffix)]
    if not fitting:
        raise InputError(path, f"csv: no table of the mapping has its suffix; there are {[t.suffix for t in tables]}")
    return max(fitting, key=lambda t: len(t.suffix))


def _read(path: Path, table: CsvTable, setup: Setup) -> Recorded:
    text = read_text(path)
    if table.dwells is not None:
        return Recorded(str(path), dwells=_dwells(text, table.dwells), notes=_unused(text, table))
    names, position = _seen(text, table)
    if table.time is None:
        q = np.stack([text.numbers([c.motor], _UNITS[c.unit])[:, 0] for c in table.joints.values()], axis=1)
        means = Means(tuple(table.joints), q, names, np.asarray(position), _std(table))
        return Recorded(str(path), means=means, notes=_unused(text, table))
    t = text.seconds(table.time.column, table.time.unit)
    _check_times(text, table.time.column, t)
    markers = None if position is None else Markers(t, names, position)
    plates, notes = _plates(text, table, setup, t)
    joints = _joints(text, table, t) if table.joints else None
    others = {"robot": joints, "plate": plates}
    together = tuple(name for name, group in others.items() if markers is not None and group is not None)
    return Recorded(str(path), markers, joints, plates, together=together, notes=(*notes, *_unused(text, table)))


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
            found = np.asarray(np.where(chosen == "", "nan", chosen) if gaps else chosen, dtype=float)
        except (ValueError, OverflowError) as error:
            row, k, text = next((r, k, t) for (r, k), t in np.ndenumerate(chosen) if not _is_number(t, gaps))
            what = f"{str(text)[:40]!r} is no number" if text else "the cell is empty"
            raise self.error(row, columns[k], f"{what}; only an occluded marker may be left out") from error
        beyond = np.argwhere(~(np.abs(found) < _LARGEST) & ~(np.isnan(found) & gaps))
        if len(beyond):
            row, k = beyond[0]
            raise self.error(row, columns[k], f"{str(chosen[row, k])[:40]!r} is no value of an instrument")
        return found * factor

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


def _seen(text: CsvText, table: CsvTable) -> tuple[tuple[str, ...], np.ndarray | None]:
    """Names and positions (n, m, 3) [m] of markers, and of those that stand for poses; None where there are none."""
    if not (table.markers or table.poses):
        return (), None
    parts = [_positions(text, table)] if table.markers else []
    parts += [_pose_markers(text, name, channels) for name, channels in table.poses.items()]
    names = (*table.markers, *(m for name in table.poses for m in marker_names(name)))
    return names, np.concatenate(parts, axis=1)


def _std(table: CsvTable) -> np.ndarray:
    """Standard deviation (m, 1) of each marker [m]."""
    drawn = [float(table.marker_std or 0.0)] * len(table.markers)
    posed = [marker_sigma(c) for c in table.poses.values() for _ in AXES]
    return np.array(drawn + posed)[:, None]


def _pose_markers(text: CsvText, name: str, channels: PoseChannels) -> np.ndarray:
    """Positions (n, 6, 3) [m] of the markers that stand for a pose."""
    p, numbers = (text.numbers(columns, gaps=True) for columns in (channels.position, channels.rotation))
    try:
        return markers_at(p, numbers, channels)
    except ValueError as error:
        raise InputError(text.path, f"pose of {name}: {error}") from error


def _positions(text: CsvText, table: CsvTable) -> np.ndarray:
    """Marker positions (n, m, 3) [m], NaN where occluded."""
    factor = LENGTHS[table.marker_unit]
    found = np.stack([text.numbers(c, factor, gaps=True) for c in table.markers.values()], axis=1)
    zero = (found == 0.0).all(axis=2)
    if table.gaps == "zero":
        found[zero] = np.nan
    elif zero.any():
        row, k = np.argwhere(zero)[0]
        column = list(table.markers.values())[k][0]
        raise text.error(row, column, "the marker is at exactly (0, 0, 0); if that is a gap, map `gaps: zero`")
    return found


def _dwells(text: CsvText, columns: tuple[str, str]) -> np.ndarray:
    """Start and stop (n, 2) [s] of each dwell."""
    found = text.numbers(columns)
    wrong = np.flatnonzero((found[:, 1] <= found[:, 0]) | (np.diff(found[:, 0], prepend=-np.inf) <= 0.0))
    if len(wrong):
        raise text.error(int(wrong[0]), columns[0], "a dwell begins before it ends and after the one before")
    return found


def _check_times(text: CsvText, column: str, t: np.ndarray) -> None:
    back = np.flatnonzero(~(np.diff(t) > 0.0))
    if len(back):
        row = int(back[0]) + 1
        why = "is the same as in the row before" if t[row] == t[row - 1] else "does not increase"
        raise text.error(row, column, f"time {text.cells[row, text.index(column)]} {why}; remove or sort such rows")
    check_times(text.path, column, t)


def _joints(text: CsvText, table: CsvTable, t: np.ndarray) -> Joints:
    def of(field: str) -> np.ndarray:
        columns = []
        for channel in table.joints.values():
            name, factor = getattr(channel, field), 1.0 if field == "effort" else _UNITS[channel.unit]
            known = [np.nan] * len(t) if name is None else text.numbers([name], factor, gaps=field != "motor")[:, 0]
            columns.append(np.asarray(known))
        return np.stack(columns, axis=1)

    wrist = None
    if (w := table.wrist) is not None:
        sign = 1.0 if w.convention == "action" else -1.0
        wrist = sign * text.numbers((*w.force, *w.moment), gaps=True)
    names = tuple(table.joints)
    return Joints(t, names, of("motor"), of("link"), of("velocity"), of("effort"), of("command"), wrist)


def _plates(text: CsvText, table: CsvTable, setup: Setup, t: np.ndarray) -> tuple[Plates | None, tuple[str, ...]]:
    if not table.plates:
        return None, ()
    known, wrenches, notes = {p.name: p for p in setup.plates}, [], []
    for name, channels in table.plates.items():
        if name not in known:
            raise InputError(text.path, f"plate {name!r} of the mapping is not in its setup, which has {sorted(known)}")
        wrench, note = _wrench(text, channels, known[name])
        wrenches.append(wrench)
        notes.append(note)
    centre = np.array([known[name].centre for name in table.plates])
    return Plates(t, tuple(table.plates), np.stack(wrenches, axis=1), centre), tuple(notes)


def _wrench(text: CsvText, channels: PlateChannels, plate: Plate) -> tuple[np.ndarray, str]:
    force = text.numbers(channels.force) * channels.signs
    moment = text.numbers(channels.moment, MOMENTS[channels.moment_unit])
    wrench = to_action(force, moment, channels, plate)
    cop = text.numbers(channels.cop, LENGTHS[channels.cop_unit], gaps=True) if channels.cop else None
    place = f"{text.path}: {', '.join((*channels.force, *channels.moment))}"
    return wrench, checked_against_cop(place, force, moment, cop, channels, plate)


def _unused(text: CsvText, table: CsvTable) -> tuple[str, ...]:
    used = {c for columns in table.markers.values() for c in columns}
    used |= {c for j in table.joints.values() for c in (j.motor, j.link, j.velocity, j.effort, j.command) if c}
    used |= {c for p in table.plates.values() for c in (*p.force, *p.moment, *(p.cop or ()))}
    used |= {*table.wrist.force, *table.wrist.moment} if table.wrist else set()
    used |= {c for p in table.poses.values() for c in (*p.position, *p.rotation)}
    used |= {table.time.column} if table.time else set()
    used |= {*table.dwells} if table.dwells else set()
    left = [name for name in text.header if name not in used]
    return (f"{text.path.name}: columns not used: {', '.join(left)}",) if left else ()


def read_text(path: Path) -> CsvText:
    """Read a file with one header line; where semicolons or tabs separate its columns, commas may be decimal.

    Raises:
        InputError: It cannot be read, has no header or no rows, names a column twice, or a row is of another length.
    """
    rows = _rows(path)
    if len(rows) < 2:
        raise InputError(f"{path}:1:1", "no rows below the header; export the file again")
    header = tuple(rows[0])
    if len(header) == 1:
        raise InputError(f"{path}:1:1", f"the first line names one column, {header[0][:40]!r}: is it the header?")
    if all(_is_number(name, gaps=False) for name in header[1:]):
        raise InputError(f"{path}:1:1", "the first line holds numbers; write a header line that names the columns")
    if len(header) > _MOST_COLUMNS:
        raise InputError(f"{path}:1:1", f"{len(header)} columns; at most {_MOST_COLUMNS} are read")
    twice = sorted({name for name in header if header.count(name) > 1})
    if twice:
        raise InputError(f"{path}:1:{header.index(twice[0]) + 1}", f"columns named more than once: {twice}")
    for line, row in enumerate(rows[1:], start=2):
        if len(row) != len(header):
            message = f"{len(row)} cells, the header has {len(header)}: truncated or damaged; export the file again"
            raise InputError(f"{path}:{line}:{len(row)}", message)
    return CsvText(path, header, np.array(rows[1:], dtype=object))


def _rows(path: Path) -> list[list[str]]:
    check_file(path, _MOST_BYTES)
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            head = stream.readline()
            separator = next((s for s in ",;\t" if s in head), ",")
            stream.seek(0)
            rows = [[cell.strip() for cell in row] for row in csv.reader(stream, delimiter=separator) if row]
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(path, f"is no CSV text ({error}); export it again") from error
    if separator != "," and not any("." in cell for row in rows[1:] for cell in row):
        rows[1:] = [[cell.replace(",", ".") for cell in row] for row in rows[1:]]
    return rows


def _is_number(text: str, gaps: bool) -> bool:
    if not text:
        return gaps
    try:
        float(text)
    except ValueError:
        return False
    return True
