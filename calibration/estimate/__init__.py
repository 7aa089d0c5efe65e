"""An estimate and its files."""

from calibration.estimate.estimate import Estimate, RobotNames
from calibration.estimate.files import CALIBRATED, calibrated_urdf, load_estimate, save_estimate

__all__ = ["CALIBRATED", "Estimate", "RobotNames", "calibrated_urdf", "load_estimate", "save_estimate"]
