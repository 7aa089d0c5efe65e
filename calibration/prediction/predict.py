"""Predictions of a dataset by every row of an estimate: every trial read once."""

from collections.abc import Callable, Iterator

import numpy as np

from calibration.estimate.drawings import redrawn
from calibration.estimate.estimate import Estimate
from calibration.estimate.rows import LADDER, PARTS
from calibration.mocap.labels import relabelled_trial
from calibration.prediction.foreign import places_hand
from calibration.prediction.predicted_trial import PredictedTrial, Prediction
from calibration.prediction.predictor import Predictor
from calibration.prediction.recordings import clocks_of
from calibration.recording.dataset import Dataset
from calibration.recording.schema import Role, TrialEntry
from calibration.recording.trial import Trial
from calibration.robot.chain import chain_of
from calibration.robot.hand import nominal_hand
from calibration.robot.laboratory import Laboratory
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.bundle.robot import BundledRobot
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.stages.joints.correction import JointModels, input_model


def predictor(estimate: Estimate, dataset: Dataset) -> Predictor:
    """Prepare the prediction of a dataset's trials; the clock from its calibration trials if the estimate has none.

    Raises:
        NotCalibrated: The estimate must not be used.
    """
    estimate.require_calibrated()
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
        if m.name not in models and m.name not in PARTS and (places_hand(m, nominal_chain) or not estimate.registered)
    )
    models |= {model.name: estimated[model.name] for model in own}
    robot = estimate.clock("robot")
    if robot is None:
        robot = next((c for c in clocks_of(dataset) if c.instrument == "robot"), None)
    joints = None
    corrected = next((models[row.name] for row in LADDER if row.joints and row.name in models), None)
    if corrected is not None and estimate.joint_models:
        inputs = input_model(Laboratory(dataset.urdf, description), corrected)
        joints = JointModels(inputs, np.array(estimate.link_zero), estimate.joint_models)
    bundled = None
    if estimate.bundle is not None:
        row = next(row for row in LADDER if row.bundle)
        bundled = BundledRobot.of(models[row.name], estimate.bundle, dataset.urdf, description)
    plate = estimate.clock("plate")
    return Predictor(
        models, dataset.urdf, description, robot, plate, estimate.suspension, joints, bundled, estimate.main
    )


def link_angles(estimate: Estimate, dataset: Dataset) -> Callable[[TrialEntry, Trial], np.ndarray]:
    """What corrects a trial's motor readings as row `full` does, (n, k) [rad, m], NaN where one is missing."""
    prepared = predictor(estimate, dataset)

    def corrected(entry: TrialEntry, trial: Trial) -> np.ndarray:
        geared = prepared.poses(entry, trial).geared()
        return trial.q_motor if geared is None else geared.trial.q_motor

    return corrected


def predict(estimate: Estimate, dataset: Dataset, role: Role = "validation") -> Iterator[PredictedTrial]:
    """Every trial of a role, read once and predicted by every row."""
    prepared = predictor(redrawn(estimate, dataset.description)[0], dataset)
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
