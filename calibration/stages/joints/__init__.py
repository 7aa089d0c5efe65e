"""Sigmoid-polynomial models of joint deflection and backlash."""

from calibration.stages.joints.correction import JointModels, correct, input_model
from calibration.stages.joints.model import JointModel
from calibration.stages.joints.repetitions import RegimeQuality, on_repetitions
from calibration.stages.joints.samples import Samples, pooled, samples_of
from calibration.stages.joints.separable_fit import limit_of
from calibration.stages.joints.stage import fit_joint_models, joints_model

__all__ = [
    "JointModel",
    "JointModels",
    "RegimeQuality",
    "Samples",
    "correct",
    "fit_joint_models",
    "input_model",
    "joints_model",
    "limit_of",
    "on_repetitions",
    "pooled",
    "samples_of",
]
