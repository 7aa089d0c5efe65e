"""Predictions: the ladder's rows, the base's pose, the compensator."""

from calibration.estimate.rows import BASELINE, LADDER, NOMINAL, LadderRow
from calibration.prediction.compensator import Compensator, HandPose
from calibration.prediction.predictor import Prediction, Predictor, predictions
from calibration.prediction.second_session import reregistered
from calibration.robot.hand_uncertainty import Session

__all__ = [
    "BASELINE",
    "LADDER",
    "NOMINAL",
    "Compensator",
    "HandPose",
    "LadderRow",
    "Prediction",
    "Predictor",
    "Session",
    "predictions",
    "reregistered",
]
