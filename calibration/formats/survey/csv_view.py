"""A CSV file by the names of its columns and the sizes of its numbers.

A marker is three columns that differ in x, y, z only; a joint a column that contains its name in the URDF; a plate
Fx..Mz with or without a prefix, its CoP columns beside them. Lengths beyond 30 are millimetres, angles beyond two turns
degrees. 6D poses: `poses_in_columns`. With CoP = c + (-My, Mx) / Fz a plate in lab axes shows its centre c.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from calibration.errors import InputError
from calibration.formats.csv.read import CsvText, read_text
from calibration.formats.mapping.channels import Joints, Markers, Means, Recorded
from calibration.formats.survey.poses_in_columns import PoseColumns, lines_of, poses_in
from calibration.formats.survey.robot import UrdfRobot
from calibration.formats.survey.view import WHOSE, WRIST, FileView, PlateView, flow
from calibration.numerics.wrench import LOADED

_TIME = re.compile(r"^(t|time|times|stamp|timestamp|seconds?|time[_ ]?(utc|s|ms|stamp))$", re.IGNORECASE)
_BEHIND = re.compile(r"^(.+?)([xyzXYZ])$")
_BEFORE = re.compile(r"^([xyzXYZ])(.+)$")
_WRENCH = re.compile(r"^(.*?)(F|Force_?|M|Moment_?|T|Torque_?|COP_?|CoP_?)$")
_FIELDS = {
    "motor": ("", "_motor", "_position", "_pos", "_q", "_actual"),
    "link": ("_link", "_absolute", "_absolute_encoder_position"),
    "velocity": ("_velocity", "_vel"),
    "effort": ("_effort", "_current"),
    "command": ("_command", "_target", "_setpoint"),
}
_DWELLS = re.compile(r"^(start|begin),(stop|end)$", re.IGNORECASE)
_FAR, _TURNS = 30.0, 4.0 * np.pi
_AGREES = 1e-3  # [m]


@dataclass(frozen=True)
class Triple:
    """Three columns that differ in the axis only: `pattern` with {name} and {axis} for what they are called."""

    name: str
    pattern: str
    columns: tuple[str, str, str]


def view_csv(path: Path, robot: UrdfRobot) -> FileView:
    """What a CSV file shows.

    Raises:
        InputError: It cannot be read, or shows neither markers, joints nor plates.
    """
    text = read_text(path)
    if len(text.header) == 2 and _DWELLS.match(",".join(text.header)):  # noqa: PLR2004
        dwells = Recorded(str(path), dwells=text.numbers(text.header))
        return FileView(path, "csv", dwells, (), (f"dwells: [{', '.join(text.header)}]",))
    timed = next((c for c in text.header if _TIME.match(c)), None)
    joints = _joint_columns(text, robot.movable)
    used: set[str | None] = {timed, *(c for of in joints.values() for c in of.values())}
    poses = poses_in(text, used)
    used |= {c for p in poses for c in p.columns}
    triples = list(_triples(c for c in text.header if c not in used))
    wrenches = {t.name: t for t in triples if _WRENCH.match(t.name)}
    markers = _of_one_pattern([t for t in triples if t.name not in wrenches])
    if not (markers or poses or wrenches or "motor" in joints):
        raise InputError(
            f"{path}:1:1", "no columns of markers (x, y, z), of the URDF's joints, or of forces and moments"
        )
    unit, t = (None, None) if timed is None else _times(text, timed)
    lines = [] if timed is None else [f"time: {flow({'column': timed, 'unit': unit})}"]
    used |= {c for m in markers for c in m.columns}
    seen, more = _seen(text, markers, poses)
    lines += more
    readings, more = _readings(text, joints, robot)
    lines += more
    parts = _wrenches(wrenches)
    wrists = [of for prefix, of in parts.items() if WRIST.search(prefix)][:1] if timed and readings else []
    plates = tuple(_plate(text, prefix or "plate", of) for prefix, of in parts.items() if not WRIST.search(prefix))
    for of in wrists:
        lines.append(_wrist_line(of))
        stored = text.numbers((*of["force"].columns, *of["moment"].columns), gaps=True)
        readings = None if readings is None else replace(readings, wrist_wrench=stored)
    used |= {c for t in wrenches.values() for c in t.columns} if plates else set()
    used |= {c for of in wrists for t in of.values() for c in t.columns}
    recorded = _recorded(path, t, seen, readings) if seen or readings else Recorded(str(path))
    return FileView(path, "csv", recorded, plates, tuple(lines), _left(text, used))


def _left(text: CsvText, used: set[str | None]) -> tuple[str, ...]:
    return tuple(c for c in text.header if c not in used)


def _recorded(path: Path, t: np.ndarray | None, markers: Markers | None, readings: Joints | None) -> Recorded:
    if t is None:
        if markers is None or readings is None:
            raise InputError(path, "no time column, and not both markers and joints: it is no table of postures")
        return Recorded(str(path), means=Means(readings.names, readings.q_motor, markers.names, markers.position, 0.0))
    at_markers = None if markers is None else Markers(t, markers.names, markers.position)
    at_joints = None if readings is None else replace(readings, t=t)
    return Recorded(str(path), at_markers, at_joints)


def _triples(columns: Iterable[str]) -> Iterable[Triple]:
    known = list(columns)
    for pattern, name_first in ((_BEHIND, True), (_BEFORE, False)):
        for column in known:
            match = pattern.match(column)
            if not match or (axis := match.group(2 if name_first else 1)) not in "xX":
                continue
            stem = match.group(1 if name_first else 2)
            axes = "xyz" if axis == "x" else "XYZ"
            three = tuple(stem + a if name_first else a + stem for a in axes)
            if not all(c in known for c in three):
                continue
            name = stem.strip("_.:- ")
            form = (stem.replace(name, "{marker}"), "{axis}" if axis == "x" else "{AXIS}")
            yield Triple(name, "".join(form if name_first else form[::-1]), three)  # type: ignore[arg-type]


def _of_one_pattern(triples: Sequence[Triple]) -> list[Triple]:
    """Those of the commonest pattern, each column used once."""
    patterns = [t.pattern for t in triples]
    best = max(patterns, key=patterns.count, default="")
    return [t for t in triples if t.pattern == best and t.name]


def _times(text: CsvText, column: str) -> tuple[str, np.ndarray]:
    first = text.cells[0, text.index(column)]
    if re.match(r"^\d{4}-\d\d-\d\d", first):
        return "utc", text.seconds(column, "utc")
    t = text.numbers([column])[:, 0]
    unit = "ms" if len(t) > 1 and float(np.median(np.diff(t))) >= 1.0 else "s"
    return unit, text.seconds(column, unit)


def _joint_columns(text: CsvText, joints: Sequence[str]) -> dict[str, dict[str, str]]:
    """Columns of each field, by joint."""
    found: dict[str, dict[str, str]] = {}
    for field, suffixes in _FIELDS.items():
        for suffix in suffixes:
            of = {j: j + suffix for j in joints if j + suffix in text.header}
            if of and field not in found:
                found[field] = of
    return found


def _seen(text: CsvText, markers: Sequence[Triple], poses: Sequence[PoseColumns]) -> tuple[Markers | None, list[str]]:
    """Markers, those that stand for poses behind them, without times; None where there are none."""
    if not (markers or poses):
        return None, []
    position, lines = _markers(text, markers) if markers else (np.zeros((len(text.cells), 0, 3)), [])
    try:
        parts = [position, *(p.positions(text) for p in poses)]
    except ValueError as error:
        raise InputError(text.path, str(error)) from error
    names = (*(m.name for m in markers), *(n for p in poses for n in p.markers))
    return Markers(np.zeros(0), names, np.concatenate(parts, axis=1)), [*lines, *lines_of(poses)]


def _markers(text: CsvText, markers: Sequence[Triple]) -> tuple[np.ndarray, list[str]]:
    raw = np.stack([text.numbers(m.columns, gaps=True) for m in markers], axis=1)
    zero = (raw == 0.0).all(axis=2)
    raw[zero] = np.nan
    unit = "mm" if float(np.nanmedian(np.abs(raw))) > _FAR else "m"
    line = f'markers: "{markers[0].pattern}"'
    lines = [line, *(["marker_unit: mm"] if unit == "mm" else []), *(["gaps: zero"] if zero.any() else [])]
    return raw * (1e-3 if unit == "mm" else 1.0), lines


def _readings(text: CsvText, columns: dict[str, dict[str, str]], robot: UrdfRobot) -> tuple[Joints | None, list[str]]:
    if "motor" not in columns:
        return None, []
    names = tuple(robot.in_order(columns["motor"]))
    slides = np.isin(names, robot.prismatic(names))
    motor = text.numbers([columns["motor"][n] for n in names])
    turns = motor[:, ~slides]
    angle, length = "rad", "m"
    if turns.size and float(np.abs(turns).max()) > _TURNS:
        angle = "deg"
    if slides.any() and float(np.abs(motor[:, slides]).max()) > 5.0:
        length = "mm"
    scale = np.where(slides, 1e-3 if length == "mm" else 1.0, np.pi / 180.0 if angle == "deg" else 1.0)
    values = {}
    for field in _FIELDS:
        of = columns.get(field, {})
        parts = [text.numbers([of[n]], gaps=True)[:, 0] if n in of else np.full(len(motor), np.nan) for n in names]
        values[field] = np.stack(parts, axis=1)
    scaled = {f: values[f] * (1.0 if f == "effort" else scale) for f in values}
    pairs = ", ".join(
        f'{f}: "{{joint}}{next(iter(of.values())).removeprefix(next(iter(of)))}"' for f, of in columns.items()
    )
    unit = f"[{angle}, {length}]" if slides.any() else angle
    joints = Joints(np.zeros(0), names, *(scaled[f] for f in ("motor", "link", "velocity", "effort", "command")))
    return joints, [f"joints: {{{pairs}, unit: {unit}}}"]


def _wrenches(triples: dict[str, Triple]) -> dict[str, dict[str, Triple]]:
    """Forces and moments that belong together, by what is before their names."""
    parts: dict[str, dict[str, Triple]] = {}
    for name, triple in triples.items():
        prefix, what = _WRENCH.findall(name)[0]
        what = what.upper().rstrip("_")
        key = "force" if what.startswith("F") else "cop" if what == "COP" else "moment"
        parts.setdefault(prefix.strip("_.- "), {})[key] = triple
    return {prefix: of for prefix, of in parts.items() if {"force", "moment"} <= of.keys()}


def _wrist_line(of: dict[str, Triple]) -> str:
    columns = {key: list(of[key].columns) for key in ("force", "moment")}
    return f"wrist: {flow(columns | {'convention': 'action'})}{WHOSE}"


def _plate(text: CsvText, name: str, of: dict[str, Triple]) -> PlateView:
    force, moment = text.numbers(of["force"].columns), text.numbers(of["moment"].columns)
    centre, size, unit, about = np.full(3, np.nan), (np.nan, np.nan), "N.m", "centre"
    if "cop" in of:
        cop = text.numbers(of["cop"].columns, gaps=True)
        loaded = np.abs(force[:, 2]) > LOADED
        for factor, moment_unit in ((1.0, "N.m"), (1e-3, "N.mm")):
            arm = factor * np.stack([-moment[:, 1], moment[:, 0]], axis=1) / np.where(loaded, force[:, 2], 1.0)[:, None]
            apart = (cop[:, :2] - arm)[loaded]
            if len(apart) and float(np.nanmedian(np.abs(apart - np.nanmedian(apart, axis=0)))) < _AGREES:
                centre, unit = np.array([*np.nanmedian(apart, axis=0), 0.0]), moment_unit
                break
        if np.abs(centre[:2]).max() < _AGREES:
            about = "lab"
        span = 2.0 * np.nanmax(np.abs(cop[loaded, :2] - centre[:2]), axis=0) if loaded.any() else [np.nan] * 2
        size = (float(np.ceil(10.0 * span[0]) / 10.0), float(np.ceil(10.0 * span[1]) / 10.0))
    columns = ", ".join(f"{key}: {flow(t.columns)}" for key, t in sorted(of.items(), key=lambda x: x[0] != "force"))
    layout = f"{columns}, axes: lab, about: {about}, force_unit: N, moment_unit: {unit}"
    wrench = np.concatenate([force, moment], axis=1)
    return PlateView(name, wrench, centre, np.eye(3), size, layout, of["force"].columns)
