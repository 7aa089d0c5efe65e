"""The zero of readings: motor minus link reading over the static calibration postures is the geometry's business.

    zero_j = mean over postures of (q_motor - q_link)_j            aligned link reading = q_link + zero

The geometry was fitted to motor readings at these postures, so a constant between the two encoders is in its offsets
already. A joint without a link encoder has no zero: NaN.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from calibration.clock import Clock
from calibration.errors import NotEnoughData
from calibration.postures import dwell_windows
from calibration.recording import Trial


def link_zeros(trials: Iterable[Trial], robot: Clock) -> np.ndarray:
    """Zeros (n_joints,) [rad, m] over all dwells of these calibration trials; NaN without a link encoder.

    Raises:
        NotEnoughData: There is no dwell with readings.
    """
    means = [row for trial in trials for row in dwell_differences(trial, robot)]
    if not means:
        raise NotEnoughData("no static calibration posture with readings: the zero between the encoders is not known")
    return np.mean(means, axis=0)


def dwell_differences(trial: Trial, robot: Clock) -> Iterator[np.ndarray]:
    """Mean motor minus link reading (n_joints,) [rad, m] of each dwell that has readings; NaN without an encoder."""
    t = robot.to_mocap(trial.t_robot)
    for start, stop in dwell_windows(trial):
        rows = (t >= start) & (t <= stop)
        if rows.any():
            yield (trial.q_motor - trial.q_link)[rows].mean(axis=0)


def aligned_link_readings(trial: Trial, zero: np.ndarray) -> np.ndarray:
    """Readings (n, n_joints) [rad, m] that stand in for q_motor in the geometry fitted to q_motor.

    Of joints without a link encoder, and where a link reading is missing, the motor's.
    """
    link = trial.q_link + zero
    return np.where(np.isfinite(link), link, trial.q_motor)
