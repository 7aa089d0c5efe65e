"""The band of each row: where the hand is with 95 %, by the covariance that `Compensator` states with its poses.

    C = R (S + Ad V Ad') R'         of the hand's place [m2, lab],   R of T_lab_H,  Ad of T_0_H^-1
    |e| <= radius of 95 %           inside; of |e|^2 as a gamma variable, see `hand_uncertainty`
    b = R Ad d                      by which a row on springs alone is known to be off, d by which the base slips

S is the covariance of the hand's local twist in the base: parameters, readings, drive trains, column; V (6,) variances
of the base's displacement in frame 0, or of its markers' pose where it is measured; a base on wheels that is taken to
stay has no band without a suspension. Noise of a reference is added.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from calibration.estimate.estimate import Estimate
from calibration.estimate.rows import LADDER, LadderRow
from calibration.mocap.cluster_pose import poses_of
from calibration.mocap.postures import readings_at
from calibration.numerics.lie import adjoint, inverse
from calibration.prediction.compensator import Compensator
from calibration.prediction.predicted_trial import PredictedTrial, Prediction
from calibration.recording.clock import Clock
from calibration.recording.schema import Description, TrialEntry
from calibration.recording.trial import Trial


@dataclass(frozen=True)
class Bands:
    """Bands of an estimate's rows in the trials of a dataset; none where the robot or the clock is not known.

    Attributes:
        estimate: Rows of other programs' models have no band.
        description: Of the dataset.
        clock: Of the encoders.
    """

    estimate: Estimate
    description: Description
    clock: Clock | None

    def on(self, predicted: PredictedTrial, entry: TrialEntry, trial: Trial) -> PredictedTrial:
        """The prediction with the covariance of each row that has one and reads the motors."""
        if self.estimate.urdf is None or self.estimate.robot is None or self.clock is None or not len(trial.t_robot):
            return predicted
        q = readings_at(trial, self.clock, trial.t_mocap, trial.q_motor)
        known, wanted = np.isfinite(q).all(axis=1), {row.model for row in predicted.rows}
        S = {name: np.full((len(q), 6, 6), np.nan) for name in self._rows if name in wanted}
        for name in S:
            S[name][known] = self._robot(name, entry.payload).predict(trial.t_mocap[known], q[known]).covariance
        base = poses_of(self.description.base_body, trial).covariance * self.description.sigmas.marker**2
        rows = (
            replace(row, covariance=_in_lab(row, S[row.model], base, predicted), offset=_offset(row, predicted))
            if row.model in S and row.encoder == "motor" and not self._unknown(row, predicted)
            else row
            for row in predicted.rows
        )
        return replace(predicted, rows=tuple(rows))

    def _unknown(self, row: Prediction, predicted: PredictedTrial) -> bool:
        """Whether the row leaves a base on wheels where it was and nothing says how far it moves."""
        return row.base == "fixed" and predicted.base is None and bool(self.description.wheels)

    @property
    def _rows(self) -> Mapping[str, LadderRow]:
        """Rows whose geometry comes with a covariance."""
        have = {m.name for m in self.estimate.models if len(m.covariance)}
        known = [row for row in LADDER if row.geometry in have]
        return {row.name: row for row in known if self.estimate.joint_models or not row.joints}

    def _robot(self, name: str, payload: float | None) -> Compensator:
        row = self._rows[name]
        robot = Compensator.of(replace(self.estimate, main=str(row.geometry)), payload)
        return robot if row.joints else replace(robot, joints=None)


def place_noise(description: Description, trial: Trial) -> np.ndarray:
    """(n, 3, 3) of the hand's place as seen, by its markers' noise [m2, lab]."""
    seen = poses_of(description.hand_body, trial)
    R = seen.T[:, :3, :3]
    return np.asarray(R @ seen.covariance[:, :3, :3] @ np.swapaxes(R, 1, 2) * description.sigmas.marker**2)


def _in_lab(row: Prediction, S: np.ndarray, markers: np.ndarray, predicted: PredictedTrial) -> np.ndarray | None:
    """(n, 3, 3) of the hand's place by S (n, 6, 6) of its twist in the base, `markers` (n, 6, 6) of the base's body."""
    T, rest = row.T_lab_hand, None if predicted.base is None else predicted.base.rest
    if row.base == "measured":
        Ad = adjoint(inverse(T) @ predicted.T_lab_B)
        S = S + Ad @ markers @ np.swapaxes(Ad, 1, 2)
    elif row.base_variance is not None and rest is not None:
        Ad = adjoint(inverse(T) @ rest.T_lab_0)
        S = S + Ad * row.base_variance[..., None, :] @ np.swapaxes(Ad, 1, 2)
    elif rest is not None:
        return None
    R = T[:, :3, :3]
    return np.asarray(R @ S[:, :3, :3] @ np.swapaxes(R, 1, 2))


def _offset(row: Prediction, predicted: PredictedTrial) -> np.ndarray | None:
    """(n, 3) of the hand's place by where the base slips to [m, lab]; None where it does not."""
    if row.base_offset is None or predicted.base is None or predicted.base.rest is None:
        return None
    T = row.T_lab_hand
    twist = adjoint(inverse(T) @ predicted.base.rest.T_lab_0) @ row.base_offset[..., None]
    return np.asarray((T[:, :3, :3] @ twist[:, :3])[..., 0])
