"""From a fit to a model of the estimate."""

import numpy as np

from calibration.inference.identifiability import identifiability
from calibration.inference.map_estimate import Fit
from calibration.inference.parameters import Model, Parameter, ParameterSet
from calibration.numerics.lie import from_vector
from calibration.robot.blocks import Placements
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel
from calibration.robot.nominal_frames import AXES, PREFIX, as_placements
from calibration.stages.geometry.hand_residual import HAND_NAMES
from calibration.stages.geometry.parameters import hand_model, reading_names


def model_of(name: str, chain: Chain, parameters: ParameterSet, found: Fit) -> Model:
    """A fit as a model with statuses and combinations."""
    known = identifiability(found.J_white, parameters)
    sigma = np.sqrt(np.diag(found.covariance))
    rows = zip(parameters.names, parameters.units, parameters.nominal, found.theta, sigma, known.status, strict=True)
    reading = found.noise_sigma(reading_names(chain))
    return Model(
        name,
        tuple(Parameter(n, u, float(x0), float(x), float(s), status) for n, u, x0, x, s, status in rows),
        known.combinations(parameters, found.theta, found.covariance),
        found.covariance,
        chain.joints,
        reading if len(reading) else np.zeros(len(chain.joints)),
        known.rank,
        known.condition,
        found.noise_sigma(HAND_NAMES),
    )


def hand_of(model: Model, chain: Chain, frames: np.ndarray) -> HandModel:
    """The robot with a model's values; nominal chain and marker frames (12,) [m, rad] where it has none."""
    nominal = hand_model(chain, frames)
    values = {p.name: p.value for p in model.parameters}
    if f"{PREFIX}.x" in values:
        arm = from_vector(np.array([values[f"{PREFIX}.{axis}"] for axis in AXES]))
        xi = as_placements(chain, arm).ravel()
        values |= dict(zip(nominal.block(Placements).names, xi, strict=True))
    known = [name for name in nominal.names if name in values]
    return nominal.with_theta(np.array([values[name] for name in known]), known)
