"""Row `full` of static postures: the geometry of `model_2`, compliance and preloaded backlash of the gears.

    reading = angle + offset + compliance * gravity torque + gap / 2 * tanh(gravity torque / tau_0)

The hand has random errors of its own besides those of the readings, widths of priors follow the data, and which gears
give and play is averaged over. Play is asked for unless the postures speak strongly against it. On real postures this,
by cross-validation, is what reaches furthest; a URDF holds its placements and not its gears. No motion is asked: where
sweeps are recorded it stands beside the rows with joint models.

A fit averaged over which gears give under load: most of a robot's do not, and asking all of them costs accuracy.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from calibration.inference.identifiability import identifiability
from calibration.inference.map_estimate import Fit
from calibration.inference.model_averaging import averaged, log_bayes_factor
from calibration.inference.outliers import RobustFit
from calibration.inference.parameters import Model, ParameterSet
from calibration.mocap.postures import Postures
from calibration.recording.schema import Description
from calibration.robot.chain import Chain
from calibration.robot.hand import preload_side
from calibration.stages.geometry.guards import unusable_fit
from calibration.stages.geometry.hand_residual import Errors
from calibration.stages.geometry.model_of_fit import model_of
from calibration.stages.geometry.parameters import COMPLIANCES, backlash_parameters, gear_parameters, play_start
from calibration.stages.geometry.stage import STAGE, fit_robustly, left_out
from calibration.verdict import Verdict

_HAND = np.array([5e-4, 1e-3])  # random errors of the hand's position [m] and rotation [rad] to begin with
_STRONG = np.log(20.0)  # evidence called strong by Kass and Raftery, JASA 1995


def calibrate_gears(chain: Chain, description: Description, postures: Postures) -> tuple[Model, tuple[Verdict, ...]]:
    """The model `full`; a verdict `refused` says that it must not be used."""
    tau = chain.gravity_torques(postures.q)
    parameters = gear_parameters(chain, description, tau)
    play = play_start(chain, description)
    errors = Errors(play, 1e-2 * play, _HAND[: postures.components // 3])
    found = fit_robustly(chain, parameters, postures, errors)
    known = identifiability(found.fit.J_white, parameters)
    refused = [Verdict(STAGE, "refused", m) for m in unusable_fit(chain, parameters, found, known, len(postures))]
    if not refused and _evidence_for_backlash(found, tau, 2.0 * play) > -_STRONG:
        more = backlash_parameters(chain, description, tau)
        again = fit_robustly(chain, more, postures, errors)
        if again.fit.converged:
            parameters, found = more, again
    model = model_of("full", chain, parameters, with_gears_averaged(found.fit, parameters))
    if refused:
        return model, tuple(refused)
    return model, (*left_out(postures, found), *_told(model))


def _evidence_for_backlash(found: RobustFit, tau: np.ndarray, width: np.ndarray) -> float:
    """Log Bayes factor of preloaded backlash with prior widths (k,), at gravity torques tau (n, k) of the postures."""
    J = -preload_side(tau[found.kept])[:, None, :] * found.fit.at.J_joint
    return log_bayes_factor(found.fit, J, width)


def _told(model: Model) -> Iterator[Verdict]:
    """What of the gears stands out."""
    for kind, ending, what, unit in (
        ("gear.", ".compliance", "gears compliant under gravity", "mrad/(N.m)"),
        ("backlash.", ".gap", "backlash preloaded by gravity", "mrad"),
    ):
        mine = [p for p in model.parameters if p.name.startswith(kind) and p.name.endswith(ending)]
        told = ", ".join(f"{p.name} {1e3 * p.value:+.1f} {unit}" for p in mine if abs(p.value) > 2.0 * p.sigma)
        if mine:
            yield Verdict(STAGE, "ok", f"{what}: {told or 'none'}")


def with_gears_averaged(fit: Fit, parameters: ParameterSet) -> Fit:
    """The fit with theta and covariance averaged; `at`'s residuals and derivatives stay those of all gears giving."""
    asked = np.flatnonzero(parameters.groups >= COMPLIANCES)
    width = np.sqrt(parameters.prior.factor(fit.widths.prior)[asked]) * parameters.tolerance[asked]
    found = averaged(fit.theta, fit.covariance, asked, width)
    return replace(fit, at=replace(fit.at, theta=found.theta), covariance=found.covariance)
