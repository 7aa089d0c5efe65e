"""The band of each row: where the hand is with 95 %, by the covariance that `Compensator` states with its poses.

    C = R (S + Ad V Ad') R'         of the hand's place [m2, lab],   R of T_lab_H,  Ad of T_0_H^-1
    b = p_full - p                  by which a row is known to be off where row `full` is delivered, whose C it has
    |e| <= radius of 95 %           inside; of |e|^2 as a gamma variable about b, see `hand_uncertainty`

S is the covariance of the hand's local twist in the base: parameters, readings, drive trains, column; V (6,) variances
of the base's displacement in frame 0, or of its markers' pose where it is measured, a mean over a dwell having no white
noise; a base on wheels that is taken to stay has no band without a suspension. Noise of a reference is added. b is from
the same source of the base's motion; of a base that is taken to stay, from the best that predicts it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from calibration.estimate.estimate import Estimate
from calibration.estimate.rows import LADDER, SOURCES, Base, LadderRow, row_of
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
        known, wanted = np.isfinite(q).all(axis=1), self._rows.keys() & {row.model for row in predicted.rows}
        own = [row for row in predicted.rows if row.model in ({self._delivered} & wanted or wanted)]
        S = {key: np.full((len(q), 6, 6), np.nan) for key in map(self._robot_of, own)}
        for (name, by_dynamics), found in S.items():
            robot = self._robot(name, by_dynamics, entry.payload)
            found[known] = robot.predict(trial.t_mocap[known], q[known]).covariance
        noise = 0.0 if entry.kind == "static" else self.description.sigmas.marker**2  # none in the mean of a dwell
        base = poses_of(self.description.base_body, trial).covariance * noise
        rows = tuple(
            replace(row, covariance=_in_lab(row, S[self._robot_of(row)], base, predicted))
            if self._robot_of(row) in S and row.encoder == "motor" and not self._unknown(row, predicted)
            else row
            for row in predicted.rows
        )
        best = {row.base: row for row in rows if row.model == self._delivered and row.encoder == "motor"}
        off = (_off(row, best) if row.model in wanted and row.encoder == "motor" else row for row in rows)
        return replace(predicted, rows=tuple(off))

    @property
    def _delivered(self) -> str:
        """Row `full` where it is the main one and has drive trains; empty where it is not."""
        return self.estimate.main if self.estimate.bundle is not None and row_of(self.estimate.main).bundle else ""

    def _unknown(self, row: Prediction, predicted: PredictedTrial) -> bool:
        """Whether the row leaves a base on wheels where it was and nothing says how far it moves."""
        return row.base == "fixed" and predicted.base is None and bool(self.description.wheels)

    @property
    def _rows(self) -> Mapping[str, LadderRow]:
        """Rows whose geometry comes with a covariance."""
        have = {m.name for m in self.estimate.models if len(m.covariance)}
        known = [row for row in LADDER if row.geometry in have]
        return {row.name: row for row in known if self.estimate.joint_models or not row.joints}

    def _robot_of(self, row: Prediction) -> tuple[str, bool]:
        """Which robot has the row's covariance: its model, and whether inverse dynamics move its base."""
        return row.model, row.base == "dynamics" and row.model == self._delivered

    def _robot(self, name: str, by_dynamics: bool, payload: float | None) -> Compensator:
        row, bundle = self._rows[name], self.estimate.bundle
        if bundle is not None and by_dynamics:
            bundle = bundle.by_dynamics
        robot = Compensator.of(replace(self.estimate, main=str(row.geometry), bundle=bundle), payload)
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


def _off(row: Prediction, best: Mapping[Base, Prediction]) -> Prediction:
    """The row with the band of the delivered one, whose predictions are by source of the base's motion."""
    sources = SOURCES if row.base == "fixed" else (row.base,)
    by = next((best[source] for source in sources if source in best), None)
    if by is None or by.covariance is None:
        return row
    return replace(row, covariance=by.covariance, offset=by.T_lab_hand[:, :3, 3] - row.T_lab_hand[:, :3, 3])
