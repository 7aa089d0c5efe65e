"""Row `full` of static postures: the geometry of `model_2`, gears that give under gravity, play that gravity holds.

    reading = angle + offset + compliance * gravity torque + held * tanh(gravity torque / tau_0)

The hand has random errors of its own besides those of the readings, widths of priors follow the data, and which gears
give and play is averaged over. Play is asked for unless the postures speak strongly against it. On real postures this,
by cross-validation, is what reaches furthest; a URDF holds its placements and not its gears. No motion is asked: where
sweeps are recorded it stands beside the rows with joint models.
"""

from collections.abc import Iterator

import numpy as np

from calibration.added_parameters import log_bayes_factor
from calibration.estimate import Model
from calibration.gear_average import with_gears_averaged
from calibration.geometry import STAGE, fit_robustly, left_out
from calibration.geometry_guards import unusable_fit
from calibration.hand import held_share
from calibration.hand_fit import Errors
from calibration.identifiability import identifiability
from calibration.parameters import gear_parameters, held_parameters, play_start
from calibration.postures import Postures
from calibration.result import model_of
from calibration.robot import Chain
from calibration.robust import RobustFit
from calibration.schema import Description
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
    if not refused and _speaks_for_play(found, tau, play) > -_STRONG:
        more = held_parameters(chain, description, tau)
        again = fit_robustly(chain, more, postures, errors)
        if again.fit.converged:
            parameters, found = more, again
    model = model_of("full", chain, parameters, with_gears_averaged(found.fit, parameters))
    if refused:
        return model, tuple(refused)
    return model, (*left_out(postures, found), *_told(model))


def _speaks_for_play(found: RobustFit, tau: np.ndarray, width: np.ndarray) -> float:
    """Log Bayes factor of held play, `width` (k,) believed, at gravity torques tau (n, k) of the postures."""
    J = -held_share(tau[found.kept])[:, None, :] * found.fit.at.J_joint
    return log_bayes_factor(found.fit, J, width)


def _told(model: Model) -> Iterator[Verdict]:
    """What of the gears stands out."""
    for ending, what, unit in (
        (".compliance", "gears that give under load", "mrad/(N.m)"),
        (".held", "play that gravity holds, half", "mrad"),
    ):
        mine = [p for p in model.parameters if p.name.startswith("gear.") and p.name.endswith(ending)]
        told = ", ".join(f"{p.name} {1e3 * p.value:+.1f} {unit}" for p in mine if abs(p.value) > 2.0 * p.sigma)
        if mine:
            yield Verdict(STAGE, "ok", f"{what}: {told or 'none'}")
