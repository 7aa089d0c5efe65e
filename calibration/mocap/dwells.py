"""Dwells of a trial that show the robot at rest.

    d = |mean p(last quarter) - mean p(first quarter)|        p the hand's mean marker in the dwell, its ends left out

A gear settles and a base creeps by fractions of a millimetre, an arm that moves does so by centimetres. Dwells that end
before they begin, begin before an earlier one ended, or lie outside the recording are none.
"""

from dataclasses import replace

import numpy as np

from calibration.mocap.measured_trial import MeasuredTrial

_MARGIN = 0.2  # [s] left out at both ends of a dwell, a quarter of it at most
_SETTLES = 1e-2  # [m]; 4 mm are what is left of a soft base's response in a dwell of 0.8 s


def inner_windows(dwells: np.ndarray) -> np.ndarray:
    """Start and stop of dwells (n, 2) [s] without their margins."""
    margin = np.minimum(_MARGIN, 0.25 * (dwells[:, 1] - dwells[:, 0]))
    return np.stack([dwells[:, 0] + margin, dwells[:, 1] - margin], axis=1)


def rests(trial: MeasuredTrial) -> np.ndarray:
    """Whether the hand rests in each dwell (n,); it does where it is not seen."""
    last, good = -np.inf, np.zeros(len(trial.dwell_start), dtype=bool)
    for k, (start, stop) in enumerate(zip(trial.dwell_start, trial.dwell_stop, strict=True)):
        inside = trial.t_mocap[0] - _MARGIN <= start < stop <= trial.t_mocap[-1] + _MARGIN
        good[k] = inside and start >= last and _travel(trial, start, stop) <= _SETTLES
        last = max(last, stop) if inside else last
    return good


def resting(trial: MeasuredTrial) -> MeasuredTrial:
    """The trial with the dwells in which the hand rests; itself where it always does."""
    good = rests(trial)
    if good.all():
        return trial
    return replace(
        trial,
        dwell_start=trial.dwell_start[good],
        dwell_stop=trial.dwell_stop[good],
        approach=trial.approach[good],
    )


def _travel(trial: MeasuredTrial, start: float, stop: float) -> float:
    """How far the markers of the hand went in a dwell [m]; 0 where they are not seen."""
    window = inner_windows(np.array([[start, stop]]))[0]
    rows = np.flatnonzero((trial.t_mocap >= window[0]) & (trial.t_mocap <= window[1]))
    p = trial.marker_position[rows][:, trial.markers_of(trial.description.hand_body.name)]
    if len(p) < 4:
        return 0.0
    quarters = np.array_split(p, 4)
    with np.errstate(invalid="ignore"):
        d = _mean(quarters[-1]) - _mean(quarters[0])
    d = d[np.isfinite(d).all(axis=1)]
    return float(np.linalg.norm(np.median(d, axis=0))) if len(d) else 0.0


def _mean(p: np.ndarray) -> np.ndarray:
    """Means (m, 3) over the samples (n, m, 3) in which a marker is seen; NaN without one."""
    seen = np.isfinite(p)
    return np.where(seen, p, 0.0).sum(axis=0) / np.where(seen.any(axis=0), seen.sum(axis=0), np.nan)
