"""From a fit to a model of the estimate."""

import numpy as np

from calibration.estimate import Model, Parameter
from calibration.identifiability import identifiability
from calibration.map_fit import Fit
from calibration.parameters import ParameterSet
from calibration.robot import Chain


def model_of(name: str, chain: Chain, parameters: ParameterSet, found: Fit) -> Model:
    """A fit as a model with statuses and combinations."""
    known = identifiability(found.J_white, parameters)
    sigma = np.sqrt(np.diag(found.covariance))
    rows = zip(parameters.names, parameters.units, parameters.nominal, found.theta, sigma, known.status, strict=True)
    return Model(
        name,
        tuple(Parameter(n, u, float(x0), float(x), float(s), status) for n, u, x0, x, s, status in rows),
        known.combinations(parameters, found.theta, found.covariance),
        found.covariance,
        chain.joints,
        found.play,
        known.rank,
        known.condition,
        found.hand_error,
    )
