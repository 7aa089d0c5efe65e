"""Stages registration and geometry: marker frames, joint placements, zeros, compliance."""

from calibration.stages.geometry.cross_validation import as_left_out
from calibration.stages.geometry.from_arrays import GeometryFit, fit_geometry
from calibration.stages.geometry.gear_deflection import calibrate_gears
from calibration.stages.geometry.model_of_fit import hand_of, model_of
from calibration.stages.geometry.parameters import geometry_parameters, reading_sigma
from calibration.stages.geometry.registration import fit_frames, register
from calibration.stages.geometry.stage import calibrate_geometry

__all__ = [
    "GeometryFit",
    "as_left_out",
    "calibrate_gears",
    "calibrate_geometry",
    "fit_frames",
    "fit_geometry",
    "geometry_parameters",
    "hand_of",
    "model_of",
    "reading_sigma",
    "register",
]
