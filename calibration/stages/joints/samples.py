"""What one joint did in each trial, thinned: inputs of its model, and the discrepancy to explain.

The zero of readings: motor minus link reading over the static calibration postures is the geometry's business.

    zero_j = mean over postures of (q_motor - q_link)_j            aligned link reading = q_link + zero

The geometry was fitted to motor readings at these postures, so a constant between the two encoders is in its offsets
already. A joint without a link encoder has no zero: NaN.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from calibration.errors import NotEnoughData
from calibration.mocap.postures import dwell_windows
from calibration.recording.clock import Clock
from calibration.recording.trial import Trial
from calibration.stages.joints.correction import InputModel, velocities

_EVERY = 0.1  # [s] between samples used
_FIELDS = ("t", "theta", "tau", "velocity", "y")


@dataclass(frozen=True)
class Samples:
    """Samples of one joint in one trial, all (n,).

    Attributes:
        trial_id: The trial, or part of it.
        t: [s, robot clock].
        theta: [rad].
        tau: [N.m].
        velocity: Motor side [rad/s].
        y: Motor minus link reading, the zero removed [rad].
    """

    trial_id: str
    t: np.ndarray
    theta: np.ndarray
    tau: np.ndarray
    velocity: np.ndarray
    y: np.ndarray

    def __len__(self) -> int:
        return len(self.y)

    def part(self, rows: np.ndarray) -> "Samples":
        """Those of the rows (m,) or mask (n,)."""
        return Samples(self.trial_id, *(getattr(self, name)[rows] for name in _FIELDS))


def samples_of(inputs: InputModel, trial: Trial, zero: np.ndarray) -> tuple[Samples | None, ...]:
    """Samples of every joint (n_joints,), None where it has no link reading in this trial.

    Raises:
        NotEnoughData: The trial lasts less than a second.
    """
    good = np.isfinite(trial.q_motor).all(axis=1)
    t, q = trial.t_robot[good], trial.q_motor[good]
    if not len(t):
        raise NotEnoughData(f"{trial.id}: no complete set of motor readings")
    rows = np.unique(np.searchsorted(t, np.arange(t[0], t[-1], _EVERY)))
    found = inputs.inputs(t[rows], q[rows], velocities(t, q)[rows])
    y = q[rows] - trial.q_link[good][rows] - zero
    has = np.isfinite(y)
    return tuple(
        Samples(trial.id, t[rows][k], *(x[k, j] for x in (found.theta, found.tau, found.velocity, y)))
        if k.any()
        else None
        for j, k in enumerate(has.T)
    )


def pooled(samples: Sequence[Samples]) -> Samples:
    """Samples of several trials in a row."""
    return Samples("", *(np.concatenate([getattr(s, name) for s in samples]) for name in _FIELDS))


def box(samples: Samples) -> np.ndarray:
    """Lowest and highest angle, lowest and highest torque (2, 2)."""
    return np.array([[x.min(), x.max()] for x in (samples.theta, samples.tau)])


def link_zeros(trials: Iterable[Trial], robot: Clock) -> np.ndarray:
    """Zeros (n_joints,) [rad, m] over all dwells of these calibration trials; NaN without a link encoder.

    Raises:
        NotEnoughData: There is no dwell with readings.
    """
    means = [row for trial in trials for row in dwell_differences(trial, robot)]
    if not means:
        raise NotEnoughData("no static calibration posture with readings: the zero between the encoders is not known")
    return _known_means(np.array(means))


def dwell_differences(trial: Trial, robot: Clock) -> Iterator[np.ndarray]:
    """Mean motor minus link reading (n_joints,) [rad, m] of each dwell that has readings; NaN without an encoder."""
    t = robot.to_mocap(trial.t_robot)
    for start, stop in dwell_windows(trial):
        rows = (t >= start) & (t <= stop)
        if rows.any():
            yield _known_means((trial.q_motor - trial.q_link)[rows])


def _known_means(x: np.ndarray) -> np.ndarray:
    """Means (k,) of the finite rows of each column of x (n, k); NaN without one."""
    known = np.isfinite(x)
    return np.where(known, x, 0.0).sum(axis=0) / np.where(known.any(axis=0), known.sum(axis=0), np.nan)


def aligned_link_readings(trial: Trial, zero: np.ndarray) -> np.ndarray:
    """Readings (n, n_joints) [rad, m] that stand in for q_motor in the geometry fitted to q_motor.

    Of joints without a link encoder, and where a link reading is missing, the motor's.
    """
    link = trial.q_link + zero
    return np.where(np.isfinite(link), link, trial.q_motor)
