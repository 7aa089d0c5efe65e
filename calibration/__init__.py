"""What a laboratory would run: recordings and a nominal URDF in, an estimate with its uncertainty out."""

from calibration.compensator import Compensator
from calibration.dataset import Dataset, load
from calibration.errors import CalibrationError
from calibration.estimate import Estimate
from calibration.estimate_files import load_estimate, save_estimate
from calibration.evaluate import Evaluation, evaluate
from calibration.pipeline import calibrate
from calibration.predict import Prediction, predictions

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
