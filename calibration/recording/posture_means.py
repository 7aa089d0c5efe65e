"""A trial of which only means are left: one row a static posture, no time and so no clock.

    q_motor (posture, joint) [rad, m]       marker_position, marker_position_std (posture, marker, axis) [m]

The standard deviations are those of the means. What a dwell looked like within itself is lost: drift, correlated noise
and motion of the base are not identifiable from such a file.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from calibration.errors import InputError, ShapeError
from calibration.recording import netcdf
from calibration.recording.trial import check_shapes, sha256

# name: (dimensions, units, what it is)
_LAYOUT: dict[str, tuple[tuple[str, ...], str, str]] = {
    "q_motor": (("posture", "joint"), "rad", "mean motor-side reading at the joint (m for prismatic joints)"),
    "marker_position": (("posture", "marker", "axis"), "m", "mean marker positions, NaN where occluded"),
    "marker_position_std": (("posture", "marker", "axis"), "m", "standard deviation of those means"),
    "approach": (("posture", "joint"), "1", "sign of each joint's last motion before the posture, 0 not known"),
}


@dataclass(frozen=True)
class PostureMeans:
    """Static postures as means.

    Attributes:
        id: Name of the trial in its dataset.
        joint: Joint names, the columns of `q_motor`.
        q_motor: (n, n_joints) [rad, m].
        marker: Marker names, length n_markers.
        marker_body: The body of each marker.
        marker_position: (n, n_markers, 3) [m], in the dataset's `marker_frame`; NaN where occluded.
        marker_position_std: (n, n_markers, 3) standard deviation of each mean [m].
        approach: (n, n_joints), -1, 0 or 1.
    """

    id: str
    joint: tuple[str, ...]
    q_motor: np.ndarray
    marker: tuple[str, ...]
    marker_body: tuple[str, ...]
    marker_position: np.ndarray
    marker_position_std: np.ndarray
    approach: np.ndarray

    def __post_init__(self) -> None:
        sizes = {"posture": len(self.q_motor), "joint": len(self.joint), "marker": len(self.marker), "axis": 3}
        check_shapes(self.id, vars(self), {name: dims for name, (dims, *_) in _LAYOUT.items()}, sizes)
        if len(self.marker_body) != len(self.marker):
            raise ShapeError(f"{self.id}: marker_body", (len(self.marker_body),), (len(self.marker),))

    def rows(self, some: slice) -> "PostureMeans":
        """Some of the postures."""
        per_posture = {name: getattr(self, name)[some] for name in _LAYOUT}
        return replace(self, **per_posture)

    def __len__(self) -> int:
        return len(self.q_motor)


def holds_means(path: Path) -> bool:
    """Whether a trial's file holds posture means instead of a continuous recording; False where it cannot be read."""
    try:
        with netcdf.opened(path) as file:
            return "q_motor" in file.variables and file.variables["q_motor"].dimensions[:1] == ("posture",)
    except InputError:
        return False


def write_means(path: Path, means: PostureMeans) -> str:
    """Write posture means as netCDF4 (f8) and return the file's sha256; the same means give the same bytes."""
    sizes = {"axis": 3, "posture": len(means), "joint": len(means.joint), "marker": len(means.marker)}
    with netcdf.created(path) as file:
        file.title = means.id
        file.Conventions = "SI; means over static postures"
        netcdf.add_dimensions(file, sizes)
        netcdf.write_labels(file, {name: getattr(means, name) for name in ("joint", "marker", "marker_body")})
        for name, (dims, units, meaning) in _LAYOUT.items():
            kind = "i1" if name == "approach" else "f8"
            netcdf.write_variable(file, name, getattr(means, name), dims, kind, {"units": units, "long_name": meaning})
    return sha256(path)


def read_means(path: Path, trial_id: str | None = None) -> PostureMeans:
    """Read posture means written by `write_means`, or by anybody to the same layout; `approach` may be missing.

    Raises:
        InputError: The file is missing, damaged, lacks a variable, or says nothing of its noise.
    """
    try:
        with netcdf.opened(path) as file:
            needed = ("joint", "marker", "marker_body", "q_motor", "marker_position", "marker_position_std")
            missing = [name for name in needed if name not in file.variables]
            if missing:
                raise InputError(
                    path, f"has no variable {missing}; see the layout in calibration/recording/posture_means.py"
                )
            fields: dict[str, Any] = {n: netcdf.array(file, n) for n in _LAYOUT if n in file.variables}
            fields.setdefault("approach", np.zeros(fields["q_motor"].shape))
            fields |= {name: netcdf.labels(file, name) for name in ("joint", "marker", "marker_body")}
            means = PostureMeans(id=trial_id or path.stem, **fields)
    except ShapeError as error:
        raise InputError(path, str(error)) from error
    seen = np.isfinite(means.marker_position)
    if not (means.marker_position_std[seen] > 0.0).all():
        raise InputError(path, "marker_position_std is not above 0 everywhere; give each mean its standard deviation")
    if not np.isfinite(means.q_motor).all():
        raise InputError(path, "q_motor is not finite everywhere; leave such postures out")
    return means
