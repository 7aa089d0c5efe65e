"""What one joint did in each trial, thinned: inputs of its model, and the discrepancy to explain."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.errors import NotEnoughData
from calibration.joint_inputs import InputModel, velocities
from calibration.recording import Trial

_EVERY = 0.05  # [s] between samples used


@dataclass(frozen=True)
class Samples:
    """Samples of one joint in one trial, all (n,).

    Attributes:
        trial_id: The trial, or part of it.
        theta: [rad].
        tau: [N.m].
        velocity: Motor side [rad/s].
        y: Motor minus link reading, the zero removed [rad].
    """

    trial_id: str
    theta: np.ndarray
    tau: np.ndarray
    velocity: np.ndarray
    y: np.ndarray

    def __len__(self) -> int:
        return len(self.y)

    def part(self, rows: np.ndarray) -> "Samples":
        """Those of the rows (m,) or mask (n,)."""
        return Samples(self.trial_id, self.theta[rows], self.tau[rows], self.velocity[rows], self.y[rows])


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
    return tuple(
        Samples(trial.id, *(x[k] for x in (found.theta[:, j], found.tau[:, j], found.velocity[:, j], y[:, j])))
        if (k := np.isfinite(y[:, j])).any()
        else None
        for j in range(y.shape[1])
    )


def pooled(samples: Sequence[Samples]) -> Samples:
    """Samples of several trials in a row."""
    names = ("theta", "tau", "velocity", "y")
    return Samples("", *(np.concatenate([getattr(s, name) for s in samples]) for name in names))


def box(samples: Samples) -> np.ndarray:
    """Lowest and highest angle, lowest and highest torque (2, 2)."""
    return np.array([[x.min(), x.max()] for x in (samples.theta, samples.tau)])
