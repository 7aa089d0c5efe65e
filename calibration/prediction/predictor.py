"""Held-out prediction of the hand pose by every model of an estimate.

    T_lab_hand(t) = T_lab_B(t)  T_B_H(q(t))

T_lab_B, where the base's marker body is:      fixed      as in the first second
                                               plate      moved by the suspension under the plate's wrench
                                               dynamics   moved by the suspension under the nominal inverse dynamics
                                               measured   by its markers throughout
q, what stands for the joints' positions:      motor      q_motor by the robot's clock; less the joint model in model_3
                                               link       link readings, their zero laid on the motor's

Of a trial nothing else is read: encoders, plate, base markers of its first second (throughout where the base is
`measured`), never hand or shoulder.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from calibration.errors import NotCalibrated, NotEnoughData
from calibration.estimate.estimate import Estimate
from calibration.estimate.rows import LADDER, Base, Encoder, LadderRow, row_of
from calibration.mocap.cluster_pose import poses_of, poses_of_means
from calibration.mocap.labels import relabelled_trials
from calibration.mocap.postures import readings_at
from calibration.numerics.lie import from_vector, mean
from calibration.prediction.base_pose import base_poses
from calibration.recording.clock import Clock
from calibration.recording.dataset import Dataset
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Description, Role, TrialEntry
from calibration.recording.trial import Trial
from calibration.robot.chain import chain_of
from calibration.robot.hand import HandModel, nominal_hand
from calibration.robot.laboratory import Laboratory
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.clocks.stage import synchronise
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.stages.joints.correction import JointModels, correct, input_model
from calibration.stages.joints.samples import aligned_link_readings
from calibration.stages.suspension.base_response import laboratory
from calibration.stages.suspension.model import Suspension

REFERENCE = 1.0  # [s] of rest at the start of every trial


@dataclass(frozen=True)
class Prediction:
    """Predicted hand poses of one trial.

    Attributes:
        model: Row of the ladder.
        base: Where the base's motion comes from.
        encoder: Which side of the gear was read.
        trial_id: The trial.
        kind: Its kind: static, sweep, swing, spin, drive.
        t: (n,) [s, mocap clock].
        T_lab_hand: (n, 4, 4), NaN where it cannot be predicted.
    """

    model: str
    base: Base
    encoder: Encoder
    trial_id: str
    kind: str
    t: np.ndarray
    T_lab_hand: np.ndarray


@dataclass(frozen=True)
class Predictor:
    """All that predicting the trials of one dataset takes.

    Attributes:
        models: Robots by row.
        urdf: Nominal robot.
        description: Of the dataset.
        robot: Clock of the encoders, None where there is no continuous recording.
        plate: Clock of the plate, None where there is none.
        suspension: None where there is none.
        joints: None where there is none.
    """

    models: dict[str, HandModel]
    urdf: str
    description: Description
    robot: Clock | None
    plate: Clock | None = None
    suspension: Suspension | None = None
    joints: JointModels | None = None

    def __call__(self, entry: TrialEntry, trial: Trial) -> Iterator[Prediction]:
        """Predictions of one trial by every model, every source of the base's motion and every encoder it has."""
        measured = self._measured_base(entry, trial)
        for row, hand, encoder in self._rows():
            q = self.positions(row.name, encoder, trial)
            known = np.isfinite(q).all(axis=1)
            T_B_H = np.full((len(q), 4, 4), np.nan)
            T_B_H[known] = hand.carrying(entry.payload).poses(q[known])
            for base in row.bases:
                T_lab_B = self._base(base, hand, entry, trial, measured)
                if T_lab_B is not None:
                    yield Prediction(row.name, base, encoder, entry.id, entry.kind, trial.t_mocap, T_lab_B @ T_B_H)

    def of_means(self, entry: TrialEntry, means: PostureMeans) -> Iterator[Prediction]:
        """Predictions of posture means, one a posture in `t`: the base measured or its markers' own frame, motor side.

        A model of the joints' hysteresis needs the motion before a posture, which means do not show.
        """
        T_lab_B = poses_of_means(self.description.base_body, means).T
        for row, hand, encoder in self._rows():
            if encoder == "motor" and row.means:
                T = T_lab_B @ hand.poses(means.q_motor)
                yield Prediction(row.name, "measured", "motor", entry.id, entry.kind, np.arange(float(len(means))), T)

    def _rows(self) -> Iterator[tuple[LadderRow, HandModel, Encoder]]:
        for row in LADDER:
            if row.name in self.models:
                for encoder in row.encoders:
                    yield row, self.models[row.name], encoder

    def positions(self, name: str, encoder: Encoder, trial: Trial) -> np.ndarray:
        """Joint positions (n, n_joints) [rad, m] the geometry is asked with, at the motion capture's times."""
        if self.robot is None or not len(trial.t_robot):
            raise NotEnoughData(f"{trial.id}: no joint readings on a known clock, so no hand pose can be predicted")
        if encoder == "link" and self.joints is not None:
            return readings_at(trial, self.robot, trial.t_mocap, aligned_link_readings(trial, self.joints.zero))
        if row_of(name).joints and self.joints is not None:
            corrected = correct(self.joints.of_trial(trial.id), trial.t_robot, trial.q_motor).q
            return readings_at(trial, self.robot, trial.t_mocap, corrected)
        return readings_at(trial, self.robot, trial.t_mocap, trial.q_motor)

    def _measured_base(self, entry: TrialEntry, trial: Trial) -> np.ndarray:
        """T_lab_B (n, 4, 4), seen where the trial starts."""
        T_lab_B = poses_of(self.description.base_body, trial).T
        if not np.isfinite(_start(T_lab_B, trial)).any():
            body = self.description.base_body.name
            raise NotEnoughData(f"{entry.id}: body {body!r} is not seen in the first second of the trial")
        return T_lab_B

    def _base(
        self, base: Base, hand: HandModel, entry: TrialEntry, trial: Trial, measured: np.ndarray
    ) -> np.ndarray | None:
        """T_lab_B (n, 4, 4), or None where that source is not there."""
        if base == "measured":
            return measured
        if base == "fixed":
            return np.broadcast_to(mean(_start(measured, trial)), measured.shape)
        if self.suspension is None or (base == "plate" and (self.plate is None or len(trial.t_plate) == 0)):
            return None
        description = self.description.loaded(entry)
        lab = laboratory(self.urdf, description, self.robot, self.plate, from_vector(hand.base))
        return base_poses(self.suspension, lab, trial, base)


def _start(T_lab_B: np.ndarray, trial: Trial) -> np.ndarray:
    return T_lab_B[trial.t_mocap <= trial.t_mocap[0] + REFERENCE]


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
    estimated = {m.name: hand_of(m, chain, frames) for m in estimate.models}
    nominal, models = nominal_hand(drawn, frames), {}
    for row in LADDER:
        hand = nominal if row.geometry is None else estimated.get(row.geometry)
        present = estimate.suspension is not None or not row.needs_suspension
        if hand is not None and present and (estimate.joint_models or not row.joints):
            models[row.name] = hand
    robot = estimate.clock("robot")
    trials = () if robot is not None else tuple(trial for _, trial in relabelled_trials(dataset, "calibration"))
    if trials:
        robot = next(
            (c for c in synchronise(Laboratory(dataset.urdf, description), trials)[0] if c.instrument == "robot"), None
        )
    joints = None
    corrected = next((models[row.name] for row in LADDER if row.joints and row.name in models), None)
    if corrected is not None:
        inputs = input_model(Laboratory(dataset.urdf, description), corrected)
        joints = JointModels(inputs, np.array(estimate.link_zero), estimate.joint_models)
    return Predictor(models, dataset.urdf, description, robot, estimate.clock("plate"), estimate.suspension, joints)


def predictions(estimate: Estimate, dataset: Dataset, role: Role = "validation") -> Iterator[Prediction]:
    """Predicted hand poses of all trials of a role, trial by trial, row by row."""
    predict = predictor(estimate, dataset)
    for entry, trial in relabelled_trials(dataset, role):
        yield from predict(entry, trial)
    for entry, means in dataset.means(role):
        yield from predict.of_means(entry, means)
