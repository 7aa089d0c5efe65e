"""A calibration of one's own: marker frames and encoder zeros by least squares. It reads the dataset folder alone."""

from calibration.fit import calibrate

__all__ = ["calibrate"]
