"""Motion capture: marker labels, cluster shapes and poses, postures of the hand."""

from calibration.mocap.cluster_pose import body_poses, poses_of
from calibration.mocap.cluster_shape import free, per_coordinate, shape_change
from calibration.mocap.labels import relabelled_trial, relabelled_trials
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.mocap.postures import Postures, mean_postures, passing_postures, static_postures

__all__ = [
    "MeasuredTrial",
    "Postures",
    "body_poses",
    "free",
    "mean_postures",
    "passing_postures",
    "per_coordinate",
    "poses_of",
    "relabelled_trial",
    "relabelled_trials",
    "shape_change",
    "static_postures",
]
