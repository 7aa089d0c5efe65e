"""Estimation: priors, maximum a posteriori, marginal likelihood, identifiability, outliers."""

from calibration.inference.identifiability import Identifiability, identifiability
from calibration.inference.map_estimate import Fit, Problem, solve
from calibration.inference.outliers import RobustFit, robust_fit
from calibration.inference.parameters import Combination, Model, Parameter, ParameterSet, Prior

__all__ = [
    "Combination",
    "Fit",
    "Identifiability",
    "Model",
    "Parameter",
    "ParameterSet",
    "Prior",
    "Problem",
    "RobustFit",
    "identifiability",
    "robust_fit",
    "solve",
]
