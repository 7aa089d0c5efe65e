"""What was true, written where no calibration looks: truth.json and, per trial, the noise-free signals."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import h5netcdf
import h5py
import numpy as np

from twin.defects.base import Parameter

_UNITS = {
    "t_mocap": "s",
    "q_motor_true": "rad, m for prismatic joints",
    "q_link_true": "rad, m for prismatic joints",
    "base_pose": "1",
    "hand_pose": "1",
    "marker_position": "m",
    "plate_wrench": "N, N.m",
}
_FRAMES = {"t_mocap": "none", "q_motor_true": "joint axis", "q_link_true": "joint axis"}
_DIMS = {
    "t_mocap": ("t_mocap",),
    "q_motor_true": ("t_mocap", "joint"),
    "q_link_true": ("t_mocap", "joint"),
    "base_pose": ("t_mocap", "row", "column"),
    "hand_pose": ("t_mocap", "row", "column"),
    "marker_position": ("t_mocap", "marker", "axis"),
    "plate_wrench": ("t_mocap", "wrench"),
}


@dataclass(frozen=True)
class TruthTrial:
    """Noise-free signals at the mocap's samples.

    Attributes:
        joint: Joint names.
        marker: Marker names.
        t_mocap: (n,) [s, mocap clock].
        q_motor_true: Motor-side angles (n, n_joints) [m, rad].
        q_link_true: Joint angles (n, n_joints) [m, rad].
        base_pose: T_lab_base (n, 4, 4), base_frame itself.
        hand_pose: T_lab_hand (n, 4, 4), the frame of marker body `gripper`.
        marker_position: (n, n_markers, 3) [m, lab].
        plate_wrench: (n, 6) [N, N.m] action on the plate, lab axes, about its centre.
    """

    joint: tuple[str, ...]
    marker: tuple[str, ...]
    t_mocap: np.ndarray
    q_motor_true: np.ndarray
    q_link_true: np.ndarray
    base_pose: np.ndarray
    hand_pose: np.ndarray
    marker_position: np.ndarray
    plate_wrench: np.ndarray


def write_trial(path: Path, trial: TruthTrial) -> None:
    """Write the signals as netCDF4, f8."""
    with h5netcdf.File(path, "w") as file:
        file.dimensions = {
            "t_mocap": len(trial.t_mocap),
            "joint": len(trial.joint),
            "marker": len(trial.marker),
            "axis": 3,
            "row": 4,
            "column": 4,
            "wrench": 6,
        }
        for label in ("joint", "marker"):
            names = np.array(getattr(trial, label), dtype=object)
            variable = file.create_variable(label, (label,), dtype=h5py.string_dtype(), data=names)
            variable.attrs.update(units="none", frame="none", clock="none")
        for name, dims in _DIMS.items():
            data = getattr(trial, name)
            variable = file.create_variable(
                name, dims, dtype="f8", data=data, compression="gzip", compression_opts=4, shuffle=True
            )
            variable.attrs.update(units=_UNITS[name], frame=_FRAMES.get(name, "lab"), clock="mocap")


def read_trial(path: Path) -> TruthTrial:
    """Read what `write_trial` wrote."""
    with h5netcdf.File(path, "r") as file:
        labels = [tuple(v.decode() if isinstance(v, bytes) else v for v in file[n][...]) for n in ("joint", "marker")]
        return TruthTrial(labels[0], labels[1], **{name: np.asarray(file[name][...]) for name in _DIMS})


def write_parameters(path: Path, parameters: Iterable[Parameter], derived: dict[str, np.ndarray]) -> None:
    """Write truth.json: every parameter, and what follows from them."""
    content = {
        "schema": 1,
        "parameters": [p._asdict() for p in parameters],
        "derived": {name: _numbers(value) for name, value in derived.items()},
    }
    path.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _numbers(value: np.ndarray) -> object:
    """Nested lists; null for what is infinite, a stiffness where nothing gives."""
    found = np.asarray(value, dtype=float).astype(object)
    found[np.isinf(np.asarray(value, dtype=float))] = None
    return found.tolist()


def read_parameters(path: Path) -> tuple[Parameter, ...]:
    """Parameters of truth.json."""
    return tuple(Parameter(**p) for p in json.loads(path.read_text(encoding="utf-8"))["parameters"])
