"""What was true, written where no calibration looks: truth.json and, per trial, the noise-free signals."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from calibration.recording import netcdf

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
AXES = ("x", "y", "z", "rx", "ry", "rz")


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
    sizes = {"t_mocap": len(trial.t_mocap), "joint": len(trial.joint), "marker": len(trial.marker)}
    with netcdf.created(path) as file:
        netcdf.add_dimensions(file, sizes | {"axis": 3, "row": 4, "column": 4, "wrench": 6})
        netcdf.write_labels(file, {"joint": trial.joint, "marker": trial.marker})
        for name, dims in _DIMS.items():
            attributes = {"units": _UNITS[name], "frame": _FRAMES.get(name, "lab"), "clock": "mocap"}
            netcdf.write_variable(file, name, getattr(trial, name), dims, "f8", attributes)


def read_trial(path: Path) -> TruthTrial:
    """Read what `write_trial` wrote.

    Raises:
        InputError: It is no such file.
    """
    with netcdf.opened(path) as file:
        joint, marker = (netcdf.labels(file, label) for label in ("joint", "marker"))
        return TruthTrial(joint, marker, **{name: netcdf.array(file, name) for name in _DIMS})


def _numbers(value: np.ndarray) -> object:
    """Nested lists; null for what is infinite, a stiffness where nothing is compliant."""
    found = np.asarray(value, dtype=float).astype(object)
    found[np.isinf(np.asarray(value, dtype=float))] = None
    return found.tolist()


class Parameter(NamedTuple):
    """One true number.

    Attributes:
        name: Name of the contract, `geometry.arm_1_joint.x` and the like.
        unit: SI unit, `-` where there is none.
        value: The value.
    """

    name: str
    unit: str
    value: float


def write_parameters(path: Path, parameters: Iterable[Parameter], derived: dict[str, np.ndarray]) -> None:
    """Write truth.json: every parameter, and what follows from them."""
    rows = ",\n  ".join(json.dumps(p._asdict(), allow_nan=False) for p in parameters)
    values = json.dumps({name: _numbers(value) for name, value in derived.items()}, allow_nan=False)
    path.write_text(f'{{"schema": 1,\n "parameters": [\n  {rows}],\n "derived": {values}}}\n', encoding="utf-8")


def read_parameters(path: Path) -> tuple[Parameter, ...]:
    """Parameters of truth.json."""
    return tuple(Parameter(**p) for p in json.loads(path.read_text(encoding="utf-8"))["parameters"])


def twist_parameters(prefix: str, values: np.ndarray) -> tuple[Parameter, ...]:
    """Six parameters `prefix.{x,y,z,rx,ry,rz}` [m, rad]."""
    units = ("m",) * 3 + ("rad",) * 3
    return tuple(Parameter(f"{prefix}.{a}", u, float(v)) for a, u, v in zip(AXES, units, values, strict=True))
