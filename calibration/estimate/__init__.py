"""An estimate and its files."""

from calibration.estimate.estimate import Estimate, RobotNames
from calibration.estimate.files import CALIBRATED, calibrated_urdf, load_estimate, save_estimate
from calibration.estimate.rows import SOURCES

__all__ = ["CALIBRATED", "SOURCES", "Estimate", "RobotNames", "calibrated_urdf", "load_estimate", "save_estimate"]
