"""A trial as CSV: one file an instrument, each on its own clock, or one row a static posture.

    <trial>.mocap.csv     t, <marker>_{x,y,z} [m]              <trial>.robot.csv   t, <joint>_{motor,link,...} [rad]
                                                               wrist_{Fx..Mz} [N, N.m] ACTION of the hand on the sensor
    <trial>.plate.csv     t, <plate>_{Fx..Mz} [N, N.m] ACTION, lab axes, about the surface centre;
                          <plate>_COP{x,y,z} [m, lab], empty while it is not loaded
    <trial>.dwells.csv    start, stop of each static posture [s, markers' clock]
    <trial>.postures.csv  the means

Numbers are written with the digits their stored precision has, so that reading them back gives the same bits.
"""

from pathlib import Path

import numpy as np

from calibration.formats.mapping.layouts import PlateChannels, WristChannels
from calibration.numerics.wrench import centre_of_pressure
from calibration.recording.posture_means import PostureMeans
from calibration.recording.trial import Trial

FIELDS = {"motor": "q_motor", "link": "q_link", "velocity": "v_motor", "effort": "effort", "command": "q_command"}
_COMPONENTS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
_COP = ("COPx", "COPy", "COPz")
WRIST = tuple(f"wrist_{c}" for c in _COMPONENTS)


def write_csv(folder: Path, trial: Trial) -> None:
    """Write the files of a continuous trial; an instrument that was not there has none."""
    if len(trial.t_mocap):
        p = trial.marker_position.reshape(len(trial.t_mocap), -1)
        _write(folder / f"{trial.id}.mocap.csv", _marker_columns(trial.marker), trial.t_mocap, p)
    if len(trial.t_robot):
        names = [f"{joint}_{field}" for joint in trial.joint for field in FIELDS]
        readings = np.stack([getattr(trial, name) for name in FIELDS.values()], axis=2)
        table = readings.reshape(len(readings), -1)
        if np.isfinite(trial.wrist_wrench).any():
            names, table = [*names, *WRIST], np.concatenate([table, trial.wrist_wrench], axis=1)
        _write(folder / f"{trial.id}.robot.csv", names, trial.t_robot, table)
    if len(trial.dwell_start):
        both = np.stack([trial.dwell_start, trial.dwell_stop], axis=1)
        _lines(folder / f"{trial.id}.dwells.csv", ["start", "stop"], both.astype(str))
    if len(trial.t_plate):
        names = [f"{plate}_{c}" for plate in trial.plate for c in (*_COMPONENTS, *_COP)]
        wrenches = trial.plate_wrench.swapaxes(0, 1)
        cop = [centre_of_pressure(w, c) for w, c in zip(wrenches, trial.plate_centre, strict=True)]
        both = np.concatenate([trial.plate_wrench, np.stack(cop, axis=1)], axis=2)
        _write(folder / f"{trial.id}.plate.csv", names, trial.t_plate, both.reshape(len(both), -1))


def write_means_csv(folder: Path, means: PostureMeans) -> None:
    """Write posture means; the markers' standard deviation goes into the mapping."""
    values = np.concatenate([means.marker_position.reshape(len(means), -1), means.q_motor], axis=1)
    cells = np.where(np.isfinite(values), values.astype(str), "")
    _lines(folder / f"{means.id}.postures.csv", [*_marker_columns(means.marker), *means.joint], cells)


def plate_columns(plate: str) -> PlateChannels:
    """How the mapping file describes a plate's columns."""
    fx, fy, fz, mx, my, mz, x, y, z = (f"{plate}_{c}" for c in (*_COMPONENTS, *_COP))
    return PlateChannels(
        force=(fx, fy, fz), moment=(mx, my, mz), cop=(x, y, z), convention="action", axes="lab", about="centre",
        force_unit="N", moment_unit="N.m",
    )  # fmt: skip


def wrist_columns() -> WristChannels:
    """How the mapping file describes the columns of the wrist's sensor."""
    fx, fy, fz, mx, my, mz = WRIST
    return WristChannels(force=(fx, fy, fz), moment=(mx, my, mz), convention="action")


def _marker_columns(markers: tuple[str, ...]) -> list[str]:
    return [f"{marker}_{axis}" for marker in markers for axis in "xyz"]


def _write(path: Path, names: list[str], t: np.ndarray, values: np.ndarray) -> None:
    """Times with all their digits, signals as float32; an empty cell for NaN."""
    cells = np.where(np.isfinite(values), values.astype(np.float32).astype(str), "")
    _lines(path, ["t", *names], np.concatenate([t.astype(str)[:, None], cells], axis=1))


def _lines(path: Path, header: list[str], cells: np.ndarray) -> None:
    lines = (",".join(row) for row in [header, *cells.tolist()])
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
