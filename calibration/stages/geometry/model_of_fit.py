"""From a fit to a model of the estimate."""

import numpy as np

from calibration.inference.identifiability import identifiability
from calibration.inference.map_estimate import Fit
from calibration.inference.parameters import Model, Parameter, ParameterSet
from calibration.numerics.lie import from_vector
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel, nominal_hand
from calibration.robot.nominal_frames import AXES, PREFIX, as_placements
from calibration.stages.geometry.parameters import parameter_names


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


def hand_of(model: Model, chain: Chain, frames: np.ndarray) -> HandModel:
    """The robot with a model's values; nominal chain and marker frames (12,) [m, rad] where it has none."""
    nominal = nominal_hand(chain, frames)
    values = {p.name: p.value for p in model.parameters}
    theta = np.array([values.get(n, x) for n, x in zip(parameter_names(chain), nominal.theta, strict=True)])
    if f"{PREFIX}.x" in values:
        arm = from_vector(np.array([values[f"{PREFIX}.{axis}"] for axis in AXES]))
        theta[12 : 12 + 6 * len(chain.joints)] = as_placements(chain, arm).ravel()
    return nominal.with_theta(theta)
