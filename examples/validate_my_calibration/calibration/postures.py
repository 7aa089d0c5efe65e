"""Static postures of a dataset as arrays, the robot's clock aligned with the motion capture's.

The offset of the clocks is where the joints' speed and the hand markers' speed correlate best.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import netCDF4
import numpy as np

RATE = 100.0  # [Hz] of the common time grid
LONGEST = 10.0  # [s] offset between the clocks


@dataclass(frozen=True)
class Postures:
    """Means over rests of the arm.

    Attributes:
        joints: Names, base to tip.
        q: (n, n_joints) motor readings [rad, m].
        base: (n, n_markers, 3) markers of the base [m, lab].
        hand: (n, n_markers, 3) markers of the hand [m, lab].
    """

    joints: tuple[str, ...]
    q: np.ndarray
    base: np.ndarray
    hand: np.ndarray


def read_postures(dataset: Path, base: str, hand: str) -> Postures:
    """The calibration postures of a dataset; `base` and `hand` name its marker bodies."""
    trials = json.loads((dataset / "dataset.json").read_text(encoding="utf-8"))["trials"]
    entry = next(t for t in trials if t["role"] == "calibration" and t["kind"] == "static")
    with netCDF4.Dataset(dataset / entry["file"]) as file:
        names = ("t_robot", "q_motor", "t_mocap", "marker_position", "dwell_start", "dwell_stop")
        t, q, t_mocap, markers, start, stop = (np.ma.filled(file[name][:].astype(float), np.nan) for name in names)
        body, joints = np.array(file["marker_body"][:]), tuple(file["joint"][:])
    offset = clock_offset(t, q, t_mocap, markers[:, body == hand])
    rests = [(a + 0.1 * (b - a), b) for a, b in zip(start, stop, strict=True)]
    readings = np.array([q[(t + offset > a) & (t + offset < b)].mean(axis=0) for a, b in rests])
    seen = np.array([np.nanmean(markers[(t_mocap > a) & (t_mocap < b)], axis=0) for a, b in rests])
    good = np.isfinite(readings).all(axis=1) & np.isfinite(seen).all(axis=(1, 2))
    return Postures(joints, readings[good], seen[good][:, body == base], seen[good][:, body == hand])


def clock_offset(t: np.ndarray, q: np.ndarray, t_mocap: np.ndarray, hand: np.ndarray) -> float:
    """Time [s] to add to the robot's clock: t_mocap = t + offset."""
    centre = np.nanmean(hand, axis=1)
    n = int(round((t[-1] - t[0]) * RATE))
    grid = np.arange(n) / RATE
    arm = speed(np.array([np.interp(t[0] + grid, t, column) for column in q.T]).T)
    lags = np.arange(-int(LONGEST * RATE), int(LONGEST * RATE) + 1)
    good = np.isfinite(centre).all(axis=1)
    start = t[0] - LONGEST
    longer = start + np.arange(n + 2 * int(LONGEST * RATE)) / RATE
    seen = speed(np.array([np.interp(longer, t_mocap[good], column[good]) for column in centre.T]).T)
    match = [np.corrcoef(arm, seen[k + lags[-1] : k + lags[-1] + n])[0, 1] for k in lags]
    return float(lags[int(np.argmax(match))] / RATE)


def speed(x: np.ndarray) -> np.ndarray:
    """Magnitude (n,) of the derivative of x (n, k), smoothed over 0.1 s."""
    return np.convolve(np.linalg.norm(np.gradient(x, axis=0), axis=1), np.ones(10) / 10, mode="same")
