"""The base on its wheels in the floor's plane: it sticks, slips and is predicted with a band."""

from calibration.stages.stick_slip.forcing import PlanarForcing, planar_forcing, wrenches_of
from calibration.stages.stick_slip.model import StickSlip
from calibration.stages.stick_slip.poses import BasePrediction, SlippingMotion, slipping_base_poses
from calibration.stages.stick_slip.stage import STAGE, fit_stick_slip

__all__ = [
    "STAGE",
    "BasePrediction",
    "PlanarForcing",
    "SlippingMotion",
    "StickSlip",
    "fit_stick_slip",
    "planar_forcing",
    "slipping_base_poses",
    "wrenches_of",
]
