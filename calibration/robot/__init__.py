"""The nominal robot: chain, kinematics, gravity torques, hand, frames."""

from calibration.robot.chain import Chain, chain_of
from calibration.robot.hand import HandModel, nominal_hand
from calibration.robot.hand_uncertainty import Predicted, Session, Spread, predicted_points
from calibration.robot.laboratory import Laboratory, floating_model
from calibration.robot.nominal_frames import frame_names, nominal_frames

__all__ = [
    "Chain",
    "HandModel",
    "Laboratory",
    "Predicted",
    "Session",
    "Spread",
    "chain_of",
    "floating_model",
    "frame_names",
    "nominal_frames",
    "nominal_hand",
    "predicted_points",
]
