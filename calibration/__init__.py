"""What a laboratory would run: recordings and a nominal URDF in, an estimate with its uncertainty out."""

from calibration.errors import CalibrationError
from calibration.estimate.estimate import Estimate
from calibration.estimate.files import load_estimate, save_estimate
from calibration.evaluation.evaluate import Evaluation, evaluate
from calibration.pipeline import calibrate
from calibration.prediction.compensator import Compensator
from calibration.prediction.predictor import Prediction, predictions
from calibration.recording.dataset import Dataset, load

__all__ = [
    "CalibrationError",
    "Compensator",
    "Dataset",
    "Estimate",
    "Evaluation",
    "Prediction",
    "calibrate",
    "evaluate",
    "load",
    "load_estimate",
    "predictions",
    "save_estimate",
]
