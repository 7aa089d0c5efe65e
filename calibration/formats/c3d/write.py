"""A trial as a C3D file that Mokka, QTM, Nexus, Visual3D and OpenSim open: mm, N, N.mm, plates of type 2 as REACTION.

    channels = R' (-f, -m) about the transducers' origin        markers NaN -> residual -1

C3D has one rate, one start and a whole number of analog samples a frame. Each instrument's own time stands beside the
standard groups, in CLOCK, as text with all its digits: MOCAP_START, PLATE_START [s], MOCAP_SAMPLES, PLATE_SAMPLES.
"""

from pathlib import Path
from typing import Any

import numpy as np

from calibration.errors import InputError
from calibration.formats.c3d.file import CLOCK, MOST_FRAMES
from calibration.formats.c3d.plate import C3dPlate, channels_of, drawn_plate
from calibration.recording.schema import Description
from calibration.recording.trial import Trial

DWELL_EVENTS = ("dwell start", "dwell stop")
_COMPONENTS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
_EVEN = 1e-6  # [s] a sample may be off its place


def write_c3d(path: Path, trial: Trial, description: Description, depth: float = 0.0) -> None:
    """Write the markers and plates of a trial; the same trial gives the same bytes.

    Args:
        path: The file.
        trial: What was recorded.
        description: Of its dataset, for the plates' edges.
        depth: Of the transducers below the plates' surfaces [m].

    Raises:
        InputError: C3D cannot hold it: uneven times, rates that do not divide, or more than 65,535 frames.
    """
    import ezc3d

    rate = _rate(path, "markers", trial.t_mocap)
    ratio, n_frames = 1, len(trial.t_mocap)
    if len(trial.t_plate):
        ratio = _ratio(path, rate, _rate(path, "plates", trial.t_plate))
        n_frames = max(n_frames, -(-len(trial.t_plate) // ratio))
    if n_frames > MOST_FRAMES:
        raise InputError(path, f"{n_frames} frames, C3D counts {MOST_FRAMES} at most; split the trial")
    c3d: Any = ezc3d.c3d()
    _add_points(c3d, trial, rate, n_frames)
    if len(trial.t_plate):
        plates = {p.name: drawn_plate(p, depth) for p in description.plates}
        _add_plates(c3d, trial, [plates[name] for name in trial.plate], ratio * n_frames, ratio * rate)
    _add_clock(c3d, trial)
    _add_dwells(c3d, trial)
    c3d.write(str(path))


def _rate(path: Path, what: str, t: np.ndarray) -> float:
    """Samples a second of even times t (n,) [s]."""
    if len(t) < 2:
        raise InputError(path, f"{what}: fewer than two samples; C3D needs both markers and a rate")
    rate = float(np.round((len(t) - 1) / (t[-1] - t[0]), 6))
    steps = np.diff(t)
    if np.abs(t - t[0] - np.arange(len(t)) / rate).max() > _EVEN:
        raise InputError(
            path,
            f"{what}: steps of {1e3 * steps.min():.3f} to {1e3 * steps.max():.3f} ms; C3D has one fixed rate: "
            "export csv",
        )
    return rate


def _ratio(path: Path, markers: float, plates: float) -> int:
    ratio = plates / markers
    if abs(ratio - round(ratio)) > 1e-6 or ratio < 1.0:
        raise InputError(
            path,
            f"plates at {plates:g} Hz are no whole multiple of markers at {markers:g} Hz; C3D would "
            "drop samples: export csv",
        )
    return round(ratio)


def _add_points(c3d: Any, trial: Trial, rate: float, n_frames: int) -> None:
    points = np.full((4, len(trial.marker), n_frames), np.nan)
    points[:3, :, : len(trial.t_mocap)] = 1e3 * np.moveaxis(trial.marker_position, (2, 1, 0), (0, 1, 2))
    points[3] = 1.0
    c3d["parameters"]["POINT"]["RATE"]["value"] = [rate]
    c3d["parameters"]["POINT"]["LABELS"]["value"] = tuple(trial.marker)
    c3d["parameters"]["POINT"]["UNITS"]["value"] = ("mm",)
    c3d["data"]["points"] = points


def _add_plates(c3d: Any, trial: Trial, plates: list[C3dPlate], n: int, rate: float) -> None:
    analogs = np.zeros((1, 6 * len(plates), n))
    for k, plate in enumerate(plates):
        raw = channels_of(plate, -trial.plate_wrench[:, k]) * np.repeat([1.0, 1e3], 3)
        analogs[0, 6 * k : 6 * k + 6, : len(raw)] = raw.T
    c3d["data"]["analogs"] = analogs
    parameters = c3d["parameters"]["ANALOG"]
    parameters["RATE"]["value"] = [rate]
    parameters["LABELS"]["value"] = tuple(f"{c}{k + 1}" for k in range(len(plates)) for c in _COMPONENTS)
    parameters["UNITS"]["value"] = (*("N",) * 3, *("N.mm",) * 3) * len(plates)
    # whole numbers must be stored as whole numbers: other readers fail on plate 1.0
    _add(c3d, "FORCE_PLATFORM", "USED", [len(plates)], whole=True)
    _add(c3d, "FORCE_PLATFORM", "TYPE", [p.type for p in plates], whole=True)
    _add(c3d, "FORCE_PLATFORM", "ZERO", [0, 0], whole=True)
    _add(c3d, "FORCE_PLATFORM", "CORNERS", 1e3 * np.stack([p.corners for p in plates], axis=2))
    _add(c3d, "FORCE_PLATFORM", "ORIGIN", 1e3 * np.stack([p.origin for p in plates], axis=1))
    channels = np.arange(1, 6 * len(plates) + 1).reshape(-1, 6).T
    _add(c3d, "FORCE_PLATFORM", "CHANNEL", channels, whole=True)


def _add(c3d: Any, group: str, name: str, value: Any, whole: bool = False) -> None:
    c3d.add_parameter(group, name, np.asarray(value, dtype=float))
    if whole:
        c3d["parameters"][group][name]["type"] = 2


def _add_clock(c3d: Any, trial: Trial) -> None:
    clocks = {"MOCAP_START": repr(float(trial.t_mocap[0])), "MOCAP_SAMPLES": str(len(trial.t_mocap))}
    if len(trial.t_plate):
        clocks |= {"PLATE_START": repr(float(trial.t_plate[0])), "PLATE_SAMPLES": str(len(trial.t_plate))}
    for name, text in clocks.items():
        c3d.add_parameter(CLOCK, name, [text])


def _add_dwells(c3d: Any, trial: Trial) -> None:
    """Events at both ends of each static posture, minutes and seconds since the first frame."""
    if not len(trial.dwell_start):
        return
    times = np.stack([trial.dwell_start, trial.dwell_stop], axis=1).ravel() - trial.t_mocap[0]
    _add(c3d, "EVENT", "USED", [len(times)], whole=True)
    c3d.add_parameter("EVENT", "LABELS", list(DWELL_EVENTS) * len(trial.dwell_start))
    c3d.add_parameter("EVENT", "CONTEXTS", ["General"] * len(times))
    _add(c3d, "EVENT", "TIMES", np.stack([times // 60.0, times % 60.0]))
