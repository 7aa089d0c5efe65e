"""Predictions: every row of the ladder, the base's pose, the compensator."""

from calibration.estimate.rows import BASELINE, LADDER, NOMINAL
from calibration.prediction.another_day import on_another_day
from calibration.prediction.compensator import Compensator
from calibration.prediction.predict import link_angles, predict
from calibration.prediction.predicted_trial import BaseMotion, JointSamples, PredictedTrial, Prediction, read_predicted

__all__ = [
    "BASELINE",
    "LADDER",
    "NOMINAL",
    "BaseMotion",
    "Compensator",
    "JointSamples",
    "PredictedTrial",
    "Prediction",
    "link_angles",
    "on_another_day",
    "predict",
    "read_predicted",
]
