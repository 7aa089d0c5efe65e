"""Predictions: every row of the ladder, the base's pose, the compensator."""

from calibration.estimate.rows import BASELINE, LADDER, NOMINAL, LadderRow
from calibration.prediction.compensator import Compensator
from calibration.prediction.predict import predict
from calibration.prediction.predicted_trial import BaseMotion, JointSamples, PredictedTrial, Prediction, read_predicted
from calibration.robot.hand_uncertainty import Session

__all__ = [
    "BASELINE",
    "LADDER",
    "NOMINAL",
    "BaseMotion",
    "Compensator",
    "JointSamples",
    "LadderRow",
    "PredictedTrial",
    "Prediction",
    "Session",
    "predict",
    "read_predicted",
]
