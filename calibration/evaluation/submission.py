"""Predicted hand poses of any method as a row of the ladder.

    CSV        trial, t [s, mocap clock], x, y, z [m, lab], qw, qx, qy, qz      or T00 ... T23, row by row, for the pose
    netCDF     a group for each trial: t, position (n, 3), quaternion_wxyz or quaternion_xyzw (n, 4); or T (n, 4, 4)

Poses are compared at the camera's times: those submitted at exactly these, else between two of them by interpolation
(linear, and along the rotation between) where they are less than 0.1 s apart. What cannot be a prediction of these
trials is rejected by what would explain it (`submitted_poses`): other trials, another clock, unit, order or frame.
"""

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from calibration.errors import InputError
from calibration.evaluation.pose_errors import PoseErrors
from calibration.evaluation.submitted_poses import check_clock, check_poses, doubts
from calibration.numerics.lie import compose
from calibration.numerics.signals import interpolate_columns
from calibration.prediction.predicted_trial import Prediction
from calibration.recording import netcdf
from calibration.recording.dataset import Dataset
from calibration.recording.schema import Role, TrialEntry
from calibration.verdict import Verdict

_GAP = 0.1  # [s] between neighbours that are interpolated
_GAPS = 2e-3  # [-] share of a trial without a prediction that is warned of
_UNIT = 1e-3  # [-] departure of a quaternion's norm, or of R R', from 1
_POSITION, _QUATERNION = ("x", "y", "z"), ("qw", "qx", "qy", "qz")
_MATRIX = tuple(f"T{i}{j}" for i in range(3) for j in range(4))


@dataclass(frozen=True)
class SubmittedTrial:
    """Poses of one trial: t (n,) [s, mocap clock], T_lab_hand (n, 4, 4), NaN where there is none."""

    t: np.ndarray
    T: np.ndarray


@dataclass(frozen=True)
class Submission:
    """Predictions of a method.

    Attributes:
        path: Where they were read.
        trials: By the trial's name.
    """

    path: Path
    trials: Mapping[str, SubmittedTrial]

    @property
    def name(self) -> str:
        """Of the row: that of the file."""
        return self.path.stem

    def row(self, entry: TrialEntry, t: np.ndarray, T_measured: np.ndarray) -> Prediction | None:
        """The prediction at t (n,) [s], None where the trial is missing.

        Raises:
            InputError: The poses are on another clock, in another unit, order or frame.
        """
        if entry.id not in self.trials:
            return None
        one = self.trials[entry.id]
        if entry.kind != "static" or len(one.t) != len(t) or not np.array_equal(one.t, t):
            check_clock(self.path, entry.id, one.t, t)
        T = _at(one, t)
        check_poses(self.path, entry.id, t, T, T_measured)
        return Prediction(self.name, "submitted", "motor", entry.id, entry.kind, t, T)

    def remarks(
        self, dataset: Dataset, role: Role, scored: Sequence[tuple[Prediction, PoseErrors]]
    ) -> Iterator[Verdict]:
        """Warnings of missing trials and poses, and of what explains the errors of those that are `scored`.

        Raises:
            InputError: It has trials that the dataset does not have.
        """
        known = {entry.id for entry in dataset.entries(role)}
        unknown = sorted(self.trials.keys() - known - {entry.id for entry in dataset.entries("confirmation")})
        if unknown:
            raise InputError(self.path, f"no {role} trial named {', '.join(unknown)}; there are {sorted(known)}")
        missing = sorted(known - self.trials.keys())
        if missing:
            yield Verdict("evaluation", "warning", f"{self.name}: no prediction of trial {', '.join(missing)}")
        for row, error in scored:
            for doubt in doubts(row.t, row.T_lab_hand, error):
                message = (
                    f"{self.name}: {row.trial_id}: {doubt}; poses are of the marker body that dataset.json declares"
                )
                yield Verdict("evaluation", "warning", message)
            share = float(np.isnan(row.T_lab_hand[:, 0, 0]).mean())
            if share > _GAPS:
                message = f"{self.name}: {100.0 * share:.1f} % of {row.trial_id} is without a prediction and not scored"
                yield Verdict("evaluation", "warning", message)


def read_submission(path: Path | str) -> Submission:
    """Read predictions.

    Raises:
        InputError: The file cannot be read, or its columns are not those above.
    """
    path = Path(path)
    found = dict(_read_csv(path) if path.suffix.lower() == ".csv" else _read_netcdf(path))
    if not any(np.isfinite(one.T).all(axis=(1, 2)).any() for one in found.values()):
        raise InputError(path, "no trial in it, or no pose that is not NaN")
    for trial, one in found.items():
        if len(one.t) > 1 and not (np.diff(one.t) > 0.0).all():
            raise InputError(path, f"{trial}: times do not increase")
    return Submission(path, found)


def write_submission(path: Path | str, trials: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> None:
    """Write predictions as netCDF: for each trial t (n,) [s, mocap clock] and T_lab_hand (n, 4, 4), NaN where none."""
    with netcdf.created(Path(path)) as file:
        for trial, (t, T) in trials.items():
            group = file.createGroup(trial)
            netcdf.add_dimensions(group, {"t": len(t), "row": 4, "column": 4})
            netcdf.write_variable(group, "t", t, ("t",), "f8", {"units": "s", "clock": "mocap"})
            netcdf.write_variable(group, "T", T, ("t", "row", "column"), "f8", {"units": "m", "frame": "lab"})


def _read_csv(path: Path) -> Iterator[tuple[str, SubmittedTrial]]:
    try:
        with path.open(encoding="utf-8", newline="") as file:
            reader = csv.DictReader(file)
            columns = tuple(reader.fieldnames or ())
            pose = _MATRIX if set(_MATRIX) <= set(columns) else (*_POSITION, *_QUATERNION)
            missing = [name for name in ("trial", "t", *pose) if name not in columns]
            if missing:
                raise InputError(path, f"columns {missing} are missing; needed: trial, t, x, y, z, qw, qx, qy, qz")
            rows = [(row["trial"], [float(row[name] or "nan") for name in ("t", *pose)]) for row in reader]
    except (OSError, UnicodeDecodeError, ValueError, TypeError) as error:
        raise InputError(path, f"not a table of predicted poses ({error})") from error
    for trial in dict.fromkeys(name for name, _ in rows):
        x = np.array([values for name, values in rows if name == trial])
        yield (
            trial,
            SubmittedTrial(
                x[:, 0], _of_matrix(path, trial, x[:, 1:]) if pose is _MATRIX else _poses(path, trial, x[:, 1:])
            ),
        )


def _read_netcdf(path: Path) -> Iterator[tuple[str, SubmittedTrial]]:
    with netcdf.opened(path, "see the formats of predictions") as file:
        for trial, group in file.groups.items():
            t = netcdf.array(group, "t")
            if "T" in group.variables:
                T = netcdf.array(group, "T")
                if not np.allclose(T[np.isfinite(T).all(axis=(1, 2)), 3], (0.0, 0.0, 0.0, 1.0)):
                    raise InputError(path, f"{trial}: the last row of T is not 0 0 0 1; is T transposed?")
                yield trial, SubmittedTrial(t, _of_matrix(path, trial, T[:, :3].reshape(len(t), 12)))
                continue
            orders = [name for name in ("quaternion_wxyz", "quaternion_xyzw") if name in group.variables]
            if len(orders) != 1:
                raise InputError(path, f"{trial}: needs quaternion_wxyz or quaternion_xyzw, or T")
            q = netcdf.array(group, orders[0])
            q = q if orders[0].endswith("wxyz") else q[:, [3, 0, 1, 2]]
            yield trial, SubmittedTrial(t, _poses(path, trial, np.hstack([netcdf.array(group, "position"), q])))


def _of_matrix(path: Path, trial: str, x: np.ndarray) -> np.ndarray:
    T, good = np.tile(np.eye(4), (len(x), 1, 1)), np.isfinite(x).all(axis=1)
    T[:, :3] = x.reshape(-1, 3, 4)
    T[~good] = np.nan
    R = T[good, :3, :3]
    if (np.abs(R @ np.swapaxes(R, 1, 2) - np.eye(3)) > _UNIT).any() or (np.linalg.det(R) < 0.0).any():
        raise InputError(path, f"{trial}: T has rotations that are none: R R' must be 1, the determinant 1")
    return T


def _poses(path: Path, trial: str, x: np.ndarray) -> np.ndarray:
    """Poses (n, 4, 4) of positions and quaternions w, x, y, z (n, 7)."""
    T, good = np.full((len(x), 4, 4), np.nan), np.isfinite(x).all(axis=1)
    norms = np.linalg.norm(x[good, 3:], axis=1)
    if (np.abs(norms - 1.0) > _UNIT).any():
        raise InputError(path, f"{trial}: quaternions of norm {norms.min():.3g} to {norms.max():.3g}; it must be 1")
    T[good] = compose(Rotation.from_quat(x[good, 3:], scalar_first=True).as_matrix(), x[good, :3])
    return T


def _at(one: SubmittedTrial, t: np.ndarray) -> np.ndarray:
    """Poses (n, 4, 4) at t (n,) [s]."""
    good = np.isfinite(one.T).all(axis=(1, 2))
    known, T = one.t[good], one.T[good]
    out = np.full((len(t), 4, 4), np.nan)
    if not len(known):
        return out
    place = np.clip(np.searchsorted(known, t), 0, len(known) - 1)
    exact = known[place] == t
    out[exact] = T[place[exact]]
    after = np.clip(np.searchsorted(known, t), 1, max(len(known) - 1, 1))
    between = ~exact & (t > known[0]) & (t < known[-1])
    if len(known) > 1 and between.any():
        between &= np.diff(known)[after - 1] <= _GAP
        turned = Slerp(known, Rotation.from_matrix(T[:, :3, :3]))(t[between]).as_matrix()
        out[between] = compose(turned, interpolate_columns(t[between], known, T[:, :3, 3]))
    return out
