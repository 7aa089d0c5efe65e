"""A fit averaged over which gears give under load: most of a robot's do not, and asking all of them costs accuracy."""

from dataclasses import replace

import numpy as np

from calibration.map_fit import Fit
from calibration.model_average import averaged
from calibration.parameters import COMPLIANCES, ParameterSet


def with_gears_averaged(fit: Fit, parameters: ParameterSet) -> Fit:
    """The fit with theta and covariance averaged; `at`'s residuals and derivatives stay those of all gears giving."""
    asked = np.flatnonzero(parameters.groups >= COMPLIANCES)
    width = np.sqrt(parameters.prior.factor(fit.widths.prior)[asked]) * parameters.tolerance[asked]
    found = averaged(fit.theta, fit.covariance, asked, width)
    return replace(fit, at=replace(fit.at, theta=found.theta), covariance=found.covariance)
