"""Held-out prediction of the hand pose by every model of an estimate.

    T_lab_hand(t) = T_lab_B(t)  T_B_H(q(t))

T_lab_B, where the base's marker body is:      fixed      as in the first second
                                               plate      moved by the suspension under the plate's wrench
                                               dynamics   moved by the suspension under the nominal inverse dynamics
                                               measured   by its markers throughout
q, readings the geometry is evaluated at:      motor      q_motor by the robot's clock; less the joint model in model_3
                                               link       link readings, their zero laid on the motor's

Of a trial nothing else is read: encoders, plate, base markers of its first second (throughout where the base is
`measured`), never hand or shoulder.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

from calibration.errors import NotCalibrated, NotEnoughData
from calibration.estimate.estimate import Estimate
from calibration.estimate.rows import LADDER, NOMINAL, Base, Encoder, LadderRow, row_of
from calibration.mocap.cluster_pose import poses_of, poses_of_means
from calibration.mocap.labels import relabelled_trial, relabelled_trials
from calibration.mocap.postures import dwell_windows, readings_at
from calibration.numerics.lie import from_vector, mean
from calibration.prediction.base_pose import BaseInTrial
from calibration.prediction.foreign import places_hand
from calibration.prediction.predicted_trial import BaseMotion, JointSamples, PredictedTrial, Prediction
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
from calibration.stages.joints.correction import Corrected, JointModels, correct, input_model
from calibration.stages.joints.samples import aligned_link_readings, samples_of
from calibration.stages.suspension.base_response import laboratory
from calibration.stages.suspension.model import Source, Suspension
from calibration.stages.suspension.rest_frame import Rest

REFERENCE = 1.0  # [s] of rest at the start of every trial
Side = Literal["motor", "corrected", "link"]  # readings the geometry is evaluated at


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

    def __call__(self, entry: TrialEntry, trial: Trial) -> PredictedTrial:
        """Predictions of one trial by every model, every source of the base's motion and every encoder it has."""
        T_lab_B, corrected = self._measured_base(entry, trial), self._corrected(trial)
        still = np.broadcast_to(mean(_start(T_lab_B, trial)), T_lab_B.shape)
        base, hands = self._base(entry, trial, still[0]), {id(hand): hand for hand in self.models.values()}

        @cache
        def in_base(hand: int, side: Side) -> np.ndarray:
            return _known_poses(hands[hand].carrying(entry.payload), self._positions(side, trial, corrected))

        @cache
        def displaced(source: Source, hand: int) -> tuple[Rest, np.ndarray] | None:
            if base is None or (source == "plate" and (self.plate is None or len(trial.t_plate) == 0)):
                return None
            rest = base.rest(from_vector(hands[hand].base))
            return rest, base.displacement(source, rest)

        def moved(source: Base, hand: int) -> np.ndarray | None:
            if source == "measured" or source == "fixed":
                return T_lab_B if source == "measured" else still
            found = displaced(source, hand)
            return None if found is None else found[0].poses(found[1])

        rows = tuple(
            Prediction(row.name, source, encoder, entry.id, entry.kind, trial.t_mocap, T @ in_base(id(hand), side))
            for row, hand, encoder in self._rows()
            for side in (self._side(row, encoder),)
            for source in row.bases
            if (T := moved(source, id(hand))) is not None
        )
        motion = None
        if base is not None and NOMINAL in self.models:
            found = [(source, displaced(source, id(self.models[NOMINAL]))) for source, _ in base.suspension.held_out]
            motion = _motion(T_lab_B, found)
        samples = tuple(self._samples(trial)) if entry.kind != "static" else ()
        return PredictedTrial(
            entry.id, entry.kind, trial.t_mocap, rows, motion, samples, T_lab_B, dwell_windows(trial), corrected
        )

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
        ours = [row for row in LADDER if row.name in self.models]
        theirs = [row_of(name) for name in self.models if all(name != row.name for row in LADDER)]
        for row in (*ours, *theirs):
            for encoder in row.encoders:
                yield row, self.models[row.name], encoder

    def positions(self, name: str, encoder: Encoder, trial: Trial) -> np.ndarray:
        """Joint positions (n, n_joints) [rad, m] the geometry is evaluated at, at the motion capture's times."""
        side = self._side(row_of(name), encoder)
        return self._positions(side, trial, self._corrected(trial) if side == "corrected" else None)

    def _side(self, row: LadderRow, encoder: Encoder) -> Side:
        if self.joints is None or (encoder == "motor" and not row.joints):
            return "motor"
        return "link" if encoder == "link" else "corrected"

    def _positions(self, side: Side, trial: Trial, corrected: Corrected | None) -> np.ndarray:
        if self.robot is None or not len(trial.t_robot):
            raise NotEnoughData(f"{trial.id}: no joint readings on a known clock, so no hand pose can be predicted")
        readings = trial.q_motor
        if side == "link" and self.joints is not None:
            readings = aligned_link_readings(trial, self.joints.zero)
        elif side == "corrected" and corrected is not None:
            readings = corrected.q
        return readings_at(trial, self.robot, trial.t_mocap, readings)

    def _corrected(self, trial: Trial) -> Corrected | None:
        if self.joints is None or not len(trial.t_robot):
            return None
        return correct(self.joints.of_trial(trial.id), trial.t_robot, trial.q_motor)

    def _samples(self, trial: Trial) -> Iterator[JointSamples]:
        """Samples of the joints that have a model and a link encoder."""
        if self.joints is None:
            return
        names = self.joints.inputs.measured
        of_joints = samples_of(self.joints.of_trial(trial.id).inputs, trial, self.joints.zero)
        for model in self.joints.models:
            s = of_joints[names.index(model.joint)]
            if s is not None:
                predicted = model.discrepancy(s.theta, s.tau, s.velocity)
                yield JointSamples(model.joint, s.t, s.theta, s.velocity, s.y, predicted)

    def _measured_base(self, entry: TrialEntry, trial: Trial) -> np.ndarray:
        """T_lab_B (n, 4, 4), seen where the trial starts."""
        T_lab_B = poses_of(self.description.base_body, trial).T
        if not np.isfinite(_start(T_lab_B, trial)).any():
            body = self.description.base_body.name
            raise NotEnoughData(f"{entry.id}: body {body!r} is not seen in the first second of the trial")
        return T_lab_B

    def _base(self, entry: TrialEntry, trial: Trial, T_lab_B: np.ndarray) -> BaseInTrial | None:
        """The base on its suspension, its marker body at rest at T_lab_B (4, 4)."""
        if self.suspension is None:
            return None
        lab = laboratory(self.urdf, self.description.loaded(entry), self.robot, self.plate)
        return BaseInTrial(self.suspension, lab, trial, T_lab_B)


def _known_poses(hand: HandModel, q: np.ndarray) -> np.ndarray:
    """T_B_H (n, 4, 4) at q (n, n_joints), NaN where a reading is missing."""
    T, known = np.full((len(q), 4, 4), np.nan), np.isfinite(q).all(axis=1)
    T[known] = hand.poses(q[known])
    return T


def _motion(T_lab_B: np.ndarray, found: Iterable[tuple[Source, tuple[Rest, np.ndarray] | None]]) -> BaseMotion | None:
    """The base by the sources that were recorded; None where none was."""
    there = [(source, *one) for source, one in found if one is not None]
    if not there:
        return None
    rest = there[0][1]
    return BaseMotion(rest.displacement(T_lab_B), tuple((source, x) for source, _, x in there), rest)


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
    nominal_chain = chain_of(dataset.urdf, description)
    frames = nominal_frames(nominal_chain, description)
    chain = nominal_chain if estimate.urdf in (None, dataset.urdf) else chain_of(str(estimate.urdf), description)
    estimated = {m.name: hand_of(m, chain, frames) for m in estimate.models}
    nominal, models = nominal_hand(nominal_chain, frames), {}
    for row in LADDER:
        hand = nominal if row.geometry is None else estimated.get(row.geometry)
        present = estimate.suspension is not None or not row.needs_suspension
        if hand is not None and present and (estimate.joint_models or not row.joints):
            models[row.name] = hand
    own = (
        m
        for m in estimate.models
        if m.name not in models and (places_hand(m, nominal_chain) or not estimate.registered)
    )
    models |= {model.name: estimated[model.name] for model in own}
    robot = estimate.clock("robot")
    trials = () if robot is not None else tuple(trial for _, trial in relabelled_trials(dataset, "calibration"))
    if trials:
        robot = next(
            (c for c in synchronise(Laboratory(dataset.urdf, description), trials)[0] if c.instrument == "robot"), None
        )
    joints = None
    corrected = next((models[row.name] for row in LADDER if row.joints and row.name in models), None)
    if corrected is not None and estimate.joint_models:
        inputs = input_model(Laboratory(dataset.urdf, description), corrected)
        joints = JointModels(inputs, np.array(estimate.link_zero), estimate.joint_models)
    return Predictor(models, dataset.urdf, description, robot, estimate.clock("plate"), estimate.suspension, joints)


def predict(estimate: Estimate, dataset: Dataset, role: Role = "validation") -> Iterator[PredictedTrial]:
    """Every trial of a role, read once and predicted by every row."""
    prepared = predictor(estimate, dataset)
    for entry in dataset.entries(role):
        if dataset.has_means(entry):
            means = dataset.read_means(entry)
            yield PredictedTrial(
                entry.id, entry.kind, np.arange(float(len(means))), tuple(prepared.of_means(entry, means))
            )
        else:
            yield prepared(entry, relabelled_trial(dataset, entry))


def predictions(estimate: Estimate, dataset: Dataset, role: Role = "validation") -> Iterator[Prediction]:
    """Predicted hand poses of all trials of a role, trial by trial, row by row."""
    for trial in predict(estimate, dataset, role):
        yield from trial.rows
