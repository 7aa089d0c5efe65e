"""Motion of the base on its wheels under the wrench of the moving arm."""

from calibration.checks.plates import STAGE
from calibration.recording.trial import REST
from calibration.stages.suspension.base_response import base_response_of, laboratory
from calibration.stages.suspension.floor_wrench import plate_load
from calibration.stages.suspension.model import Source, Suspension
from calibration.stages.suspension.rest_frame import Rest, rest_of
from calibration.stages.suspension.stage import fit_suspension
from calibration.stages.suspension.wheels import Point, wheel_model

__all__ = [
    "Point",
    "REST",
    "Rest",
    "STAGE",
    "Source",
    "Suspension",
    "fit_suspension",
    "laboratory",
    "plate_load",
    "rest_of",
    "base_response_of",
    "wheel_model",
]
