"""The recording format: a trial as arrays with their clocks, and its netCDF4 file.

A recording holds what instruments measured, never what was true: it has no field for truth.
Each instrument keeps its own clock; t_mocap = t_i (1 + drift_i) + offset_i is estimated later.

    t_robot (n,)    q_motor, q_link, v_motor, effort, q_command (n, joint), wrist_wrench (n, 6)
    t_mocap (m,)    marker_position (m, marker, 3) [m, lab], NaN where occluded
    t_plate (p,)    plate_wrench (p, plate, 6) [N, N.m] action of the robot on the plate, lab axes, about plate_centre
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import netCDF4
import numpy as np

from calibration.errors import InputError, ShapeError
from calibration.recording import netcdf

_CLOCKS = {"t_robot": "robot", "t_mocap": "mocap", "t_plate": "plate"}
# name: (dimensions, units, what it is, frame)
_LAYOUT: dict[str, tuple[tuple[str, ...], str, str, str]] = {
    "t_robot": (("t_robot",), "s", "robot clock", "none"),
    "q_motor": (("t_robot", "joint"), "rad", "motor-side reading at the joint (m for prismatic joints)", "joint axis"),
    "q_link": (("t_robot", "joint"), "rad", "link-side reading, NaN without a link encoder", "joint axis"),
    "v_motor": (("t_robot", "joint"), "rad/s", "motor-side velocity at the joint", "joint axis"),
    "effort": (("t_robot", "joint"), "A", "motor current", "joint axis"),
    "q_command": (("t_robot", "joint"), "rad", "commanded joint position", "joint axis"),
    "wrist_wrench": (
        ("t_robot", "wrench"),
        "N, N.m",
        "action of the hand on the wrist's force-torque sensor, NaN without one",
        "wrist sensor",
    ),
    "t_mocap": (("t_mocap",), "s", "motion-capture clock", "none"),
    "marker_position": (("t_mocap", "marker", "axis"), "m", "marker positions, NaN where occluded", "lab"),
    "t_plate": (("t_plate",), "s", "force-plate clock", "none"),
    "plate_wrench": (
        ("t_plate", "plate", "wrench"),
        "N, N.m",
        "action of the robot on the plate, about plate_centre",
        "lab",
    ),
    "plate_centre": (("plate", "axis"), "m", "surface centre of each plate", "lab"),
    "dwell_start": (("posture",), "s", "start of each dwell, mocap clock", "none"),
    "dwell_stop": (("posture",), "s", "end of each dwell, mocap clock", "none"),
    "approach": (("posture", "joint"), "1", "sign of each joint's last motion before the dwell", "joint axis"),
}
_LABELS = ("joint", "marker", "marker_body", "plate")
_OPTIONAL = "wrist_wrench"  # left out of a file that would hold NaN only
_EXACT = ("t_robot", "t_mocap", "t_plate", "dwell_start", "dwell_stop", "plate_centre")
REST = 1.0  # [s] at the start of every trial
_STEPS = (1e-5, 1.0)  # [s] between samples
_LONGEST, _MOST_SAMPLES = 14_400.0, 5_000_000  # [s] of a trial; samples of a grid over it


class Variable(NamedTuple):
    """A variable of a trial's file, as its attributes say it."""

    name: str
    dims: tuple[str, ...]
    units: str
    meaning: str
    frame: str
    clock: str


def _clock(name: str, dims: tuple[str, ...]) -> str:
    return _CLOCKS.get(dims[0], "mocap" if name.startswith("dwell") else "none")


VARIABLES = tuple(Variable(n, d, u, m, f, _clock(n, d)) for n, (d, u, m, f) in _LAYOUT.items())


def _empty(*shape: int) -> np.ndarray:
    return np.zeros(shape)


def check_shapes(
    id: str, arrays: Mapping[str, Any], layout: Mapping[str, tuple[str, ...]], sizes: Mapping[str, int]
) -> None:
    """Raise ShapeError for the first array of trial `id` that its dimensions contradict."""
    for name, dims in layout.items():
        expected = tuple(sizes[d] for d in dims)
        if arrays[name].shape != expected:
            raise ShapeError(f"{id}: {name}", arrays[name].shape, expected)


@dataclass(frozen=True)
class Trial:
    """One continuous recording, every instrument on its own clock; `variables` are those of its file.

    Attributes:
        id: Name of the trial in its dataset.
        joint: Joint names, length n_joints; the columns of every (n, n_joints) array.
        t_robot: (n,) [s, robot clock].
        q_motor: (n, n_joints) [rad, m].
        q_link: (n, n_joints) [rad, m], NaN where a joint has no link encoder.
        v_motor: (n, n_joints) [rad/s, m/s].
        effort: (n, n_joints) motor current [A].
        q_command: (n, n_joints) [rad, m].
        marker: Marker names, length n_markers.
        marker_body: The body of each marker, length n_markers.
        t_mocap: (m,) [s, mocap clock].
        marker_position: (m, n_markers, 3) [m, lab], NaN where occluded.
        plate: Plate names, length n_plates.
        t_plate: (p,) [s, plate clock].
        plate_wrench: (p, n_plates, 6) [N, N.m], action on the plate, lab axes, about plate_centre.
        plate_centre: (n_plates, 3) [m, lab].
        dwell_start: (n_postures,) [s, mocap clock].
        dwell_stop: (n_postures,) [s, mocap clock].
        approach: (n_postures, n_joints), -1, 0 or 1.
        wrist_wrench: (n, 6) [N, N.m], action of the hand on the wrist's sensor, its axes, about its origin; NaN without
            one.
    """

    variables: ClassVar[tuple[Variable, ...]] = VARIABLES
    id: str
    joint: tuple[str, ...]
    t_robot: np.ndarray
    q_motor: np.ndarray
    q_link: np.ndarray
    v_motor: np.ndarray
    effort: np.ndarray
    q_command: np.ndarray
    marker: tuple[str, ...]
    marker_body: tuple[str, ...]
    t_mocap: np.ndarray
    marker_position: np.ndarray
    plate: tuple[str, ...] = ()
    t_plate: np.ndarray = field(default_factory=lambda: _empty(0))
    plate_wrench: np.ndarray = field(default_factory=lambda: _empty(0, 0, 6))
    plate_centre: np.ndarray = field(default_factory=lambda: _empty(0, 3))
    dwell_start: np.ndarray = field(default_factory=lambda: _empty(0))
    dwell_stop: np.ndarray = field(default_factory=lambda: _empty(0))
    approach: np.ndarray = field(default_factory=lambda: _empty(0, 0))
    wrist_wrench: np.ndarray = field(default_factory=lambda: _empty(0, 6))

    def __post_init__(self) -> None:
        if self.approach.size == 0:
            object.__setattr__(self, "approach", np.zeros((len(self.dwell_start), len(self.joint)), dtype=np.int8))
        if not np.isfinite(self.wrist_wrench).any():
            object.__setattr__(self, "wrist_wrench", np.full((len(self.t_robot), 6), np.nan))
        sizes = {"axis": 3, "wrench": 6, "joint": len(self.joint), "marker": len(self.marker), "plate": len(self.plate)}
        sizes |= {clock: len(getattr(self, clock)) for clock in _CLOCKS} | {"posture": len(self.dwell_start)}
        check_shapes(self.id, vars(self), {name: dims for name, (dims, *_) in _LAYOUT.items()}, sizes)
        if len(self.marker_body) != len(self.marker):
            raise ShapeError(f"{self.id}: marker_body", (len(self.marker_body),), (len(self.marker),))

    def markers_of(self, body: str) -> np.ndarray:
        """Indices of the markers of a body, in file order."""
        return np.flatnonzero(np.array(self.marker_body) == body)


def write_trial(path: Path, trial: Trial) -> str:
    """Write a trial as netCDF4 and return the file's sha256.

    Signals are stored as f4 (0.1 um at 2 m, 0.1 urad at 2 rad), times as f8; the same trial gives the same bytes.
    """
    sizes = {"axis": 3, "wrench": 6, "posture": len(trial.dwell_start)}
    sizes |= {name: len(getattr(trial, name)) for name in (*_CLOCKS, "joint", "marker", "plate")}
    with netcdf.created(path) as file:
        file.title = trial.id
        file.Conventions = "SI; wrench = action of the robot on the plate, lab axes, z up"
        netcdf.add_dimensions(file, sizes)
        netcdf.write_labels(file, {label: getattr(trial, label) for label in _LABELS})
        for v in VARIABLES:
            if v.name == _OPTIONAL and not np.isfinite(trial.wrist_wrench).any():
                continue
            kind = "i1" if v.name == "approach" else "f8" if v.name in _EXACT else "f4"
            attributes = {"units": v.units, "long_name": v.meaning, "frame": v.frame, "clock": v.clock}
            netcdf.write_variable(file, v.name, getattr(trial, v.name), v.dims, kind, attributes)
    return sha256(path)


def sha256(path: Path) -> str:
    """Hex digest of a file's bytes."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def read_trial(path: Path, trial_id: str | None = None) -> Trial:
    """Read a trial written by `write_trial`, or by anybody to the same layout.

    Raises:
        InputError: The file is missing, truncated, lacks a variable, or its clocks and dwells are not in order.
    """
    if not path.is_file():
        raise InputError(path, "no such file; restore it or remove the trial from dataset.json")
    try:
        with netcdf.opened(path) as file:
            missing = [n for n in ("joint", "marker", "marker_body", "t_robot", "q_motor") if n not in file.variables]
            if missing:
                raise InputError(path, f"has no variable {missing}; see the layout in calibration/recording/trial.py")
            trial = _trial_from(file, trial_id or path.stem)
    except ShapeError as error:
        raise InputError(path, str(error)) from error
    _check_clocks(path, trial)
    _check_dwells(path, trial)
    return trial


def _trial_from(file: netCDF4.Dataset, trial_id: str) -> Trial:
    n = {d: v.size for d, v in file.dimensions.items()} | {"axis": 3, "wrench": 6}

    def read(name: str) -> np.ndarray:
        dims = _LAYOUT[name][0]
        if name in file.variables:
            found = netcdf.array(file, name)
            return np.clip(np.nan_to_num(found, nan=9.0), -9, 9).astype(np.int8) if name == "approach" else found
        shape = tuple(n.get(d, 0) for d in dims)
        netcdf.check_size(name, shape)
        return np.full(shape, np.nan if "t_robot" in dims else 0.0)

    fields: dict[str, Any] = {k: netcdf.labels(file, k) for k in _LABELS} | {k: read(k) for k in _LAYOUT}
    return Trial(id=trial_id, **fields)


def _check_clocks(path: Path, trial: Trial) -> None:
    """See that times increase, and that a grid over them has room."""
    for clock in _CLOCKS:
        t = getattr(trial, clock)
        if len(t):
            check_times(path, clock, t)


def check_times(path: Path | str, clock: str, t: np.ndarray) -> None:
    """See that times t (n,) [s] are such as an instrument writes.

    Raises:
        InputError: They do not increase, or their span and rate are not those of seconds.
    """
    if len(t) < 2 or not np.isfinite(t).all():
        raise InputError(
            path, f"{clock} has {np.isfinite(t).sum()} finite times of {len(t)}; two at least, and no gaps"
        )
    step = np.diff(t)
    back = np.flatnonzero(~(step > 0.0))
    if len(back):
        k = back[0]
        raise InputError(
            path, f"{clock} does not increase at sample {k + 1} ({float(t[k])!r} then {float(t[k + 1])!r}); sort it"
        )
    span, usual = float(t[-1] - t[0]), float(np.median(step))
    if not _STEPS[0] <= usual <= _STEPS[1]:
        raise InputError(
            path,
            f"{clock} has a sample each {usual:.3g} s, {1.0 / usual:.3g} Hz; an instrument has "
            f"{1.0 / _STEPS[1]:g} to {1.0 / _STEPS[0]:g} Hz: is it in milliseconds?",
        )
    if span > _LONGEST or span / usual > _MOST_SAMPLES:
        raise InputError(
            path, f"{clock} spans {span:.4g} s at {1.0 / usual:.4g} Hz; split the trial, or mend its times"
        )


def _check_dwells(path: Path, trial: Trial) -> None:
    a, b = trial.dwell_start, trial.dwell_stop
    wrong = np.flatnonzero(~(b > a) | ~np.isfinite(b) | ~(np.diff(a, prepend=-np.inf) > 0.0))
    overlapping = np.flatnonzero(~(a[1:] >= b[:-1])) + 1
    for k in (*wrong[:1], *overlapping[:1]):
        raise InputError(
            path, f"dwell {k}, {float(a[k])!r} to {float(b[k])!r} s, does not begin after the one before and then end"
        )
    if not np.isin(trial.approach, (-1, 0, 1)).all():
        raise InputError(path, "approach has other values than -1, 0 and 1")
