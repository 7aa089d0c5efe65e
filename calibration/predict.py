"""Held-out prediction of the hand pose by every model of an estimate.

    fixed:     T_lab_hand(t) = T_lab_B(first second)  T_B_H(q_motor(t))
    measured:  T_lab_hand(t) = T_lab_B(t)             T_B_H(q_motor(t))

T_lab_B comes from the base markers, q_motor at mocap time t by the robot's clock. Of a trial nothing else is read:
base markers of its first second (throughout where the base is `measured`) and encoders, never hand or shoulder.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from calibration.bodies import poses_of
from calibration.clock import Clock
from calibration.clocks import synchronise
from calibration.dataset import Dataset
from calibration.errors import NotCalibrated, NotEnoughData
from calibration.estimate import Estimate
from calibration.hand import HandModel, nominal_hand
from calibration.markers import base_body
from calibration.parameters import nominal_frames
from calibration.postures import readings_at
from calibration.recording import Trial
from calibration.robot import chain_of
from calibration.schema import Body, Role, TrialEntry
from calibration.se3 import mean

REFERENCE = 1.0  # [s] of rest at the start of every trial
Base = Literal["fixed", "measured"]
_ROWS = ("nominal", "registration", "model_2")


@dataclass(frozen=True)
class Prediction:
    """Predicted hand poses of one trial.

    Attributes:
        model: Row of the ladder.
        base: Where the base's motion comes from: `fixed` or `measured`.
        encoder: `motor`.
        trial_id: The trial.
        kind: Its kind: static, sweep, swing, spin, drive.
        t: (n,) [s, mocap clock].
        T_lab_hand: (n, 4, 4), NaN where it cannot be predicted.
    """

    model: str
    base: Base
    encoder: Literal["motor"]
    trial_id: str
    kind: str
    t: np.ndarray
    T_lab_hand: np.ndarray


@dataclass(frozen=True)
class Predictor:
    """All that predicting the trials of one dataset takes."""

    models: tuple[tuple[str, HandModel], ...]
    body: Body
    robot: Clock

    def __call__(self, entry: TrialEntry, trial: Trial) -> Iterator[Prediction]:
        """Predictions of one trial by every model and every source of the base's motion."""
        T_lab_B = poses_of(self.body, trial).T
        start = T_lab_B[trial.t_mocap <= trial.t_mocap[0] + REFERENCE]
        if not np.isfinite(start).any():
            raise NotEnoughData(f"{entry.id}: body {self.body.name!r} is not seen in the first second of the trial")
        q = readings_at(trial, self.robot, trial.t_mocap)
        known = np.isfinite(q).all(axis=1)
        for name, hand in self.models:
            T_B_H = np.full((len(q), 4, 4), np.nan)
            T_B_H[known] = hand.poses(q[known])
            yield Prediction(name, "fixed", "motor", entry.id, entry.kind, trial.t_mocap, mean(start) @ T_B_H)
            yield Prediction(name, "measured", "motor", entry.id, entry.kind, trial.t_mocap, T_lab_B @ T_B_H)


def predictor(estimate: Estimate, dataset: Dataset) -> Predictor:
    """Prepare the prediction of a dataset's trials; the clock from its calibration trials if the estimate has none.

    Raises:
        NotCalibrated: The estimate must not be used.
    """
    if not estimate.calibrated:
        raise NotCalibrated([v.message for v in estimate.verdicts if v.verdict == "refused"])
    description = dataset.description
    drawn = chain_of(dataset.urdf, description)
    frames = nominal_frames(drawn, description)
    chain = drawn if estimate.urdf in (None, dataset.urdf) else chain_of(str(estimate.urdf), description)
    models = [("nominal", nominal_hand(drawn, frames))]
    models += [(m.name, m.hand(chain, frames)) for m in estimate.models if m.name in _ROWS]
    robot = estimate.clock("robot")
    if robot is None:
        trials = tuple(trial for _, trial in dataset.trials("calibration"))
        robot = synchronise(dataset.urdf, description, trials)[0][0]
    return Predictor(tuple(models), base_body(description), robot)


def predictions(estimate: Estimate, dataset: Dataset, role: Role = "validation") -> Iterator[Prediction]:
    """Predicted hand poses of all trials of a role, trial by trial, row by row."""
    predict = predictor(estimate, dataset)
    for entry, trial in dataset.trials(role):
        yield from predict(entry, trial)
