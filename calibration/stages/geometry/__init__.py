"""Stages registration and geometry: marker frames, joint placements, zeros, compliance."""

from calibration.stages.geometry.from_arrays import GeometryFit, fit_geometry
from calibration.stages.geometry.gear_deflection import calibrate_gears
from calibration.stages.geometry.model_of_fit import hand_of, model_of
from calibration.stages.geometry.registration import fit_frames, register
from calibration.stages.geometry.stage import calibrate_geometry

__all__ = [
    "GeometryFit",
    "calibrate_gears",
    "calibrate_geometry",
    "fit_frames",
    "fit_geometry",
    "hand_of",
    "model_of",
    "register",
]
