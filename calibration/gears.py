"""Row `full` of static postures: the geometry of `model_2`, and gears that give under their gravity torque.

    reading = angle + offset + compliance * gravity torque

Play that gravity holds on one flank looks like a soft gear, too: both are here. The hand has random errors of its own
besides those of the readings, widths of priors follow the data, and which gears give is averaged over. On real postures
this, by cross-validation, is what reaches furthest; a URDF holds its placements and not its gears.
"""

import numpy as np

from calibration.estimate import Model
from calibration.gear_average import with_gears_averaged
from calibration.geometry import STAGE, fit_robustly, left_out
from calibration.geometry_guards import unusable_fit
from calibration.hand_fit import Errors
from calibration.identifiability import identifiability
from calibration.parameters import gear_parameters, play_start
from calibration.postures import Postures
from calibration.result import model_of
from calibration.robot import Chain
from calibration.schema import Description
from calibration.verdict import Verdict

_HAND = np.array([5e-4, 1e-3])  # random errors of the hand's position [m] and rotation [rad] to begin with


def calibrate_gears(chain: Chain, description: Description, postures: Postures) -> tuple[Model, tuple[Verdict, ...]]:
    """The model `full`; a verdict `refused` says that it must not be used."""
    parameters = gear_parameters(chain, description, chain.gravity_torques(postures.q))
    play = play_start(chain, description)
    errors = Errors(play, 1e-2 * play, _HAND[: postures.components // 3])
    found = fit_robustly(chain, parameters, postures, errors)
    known = identifiability(found.fit.J_white, parameters)
    refused = [Verdict(STAGE, "refused", m) for m in unusable_fit(chain, parameters, found, known, len(postures))]
    model = model_of("full", chain, parameters, with_gears_averaged(found.fit, parameters))
    if refused:
        return model, tuple(refused)
    soft = [p for p in model.parameters if p.name.startswith("gear.") and abs(p.value) > 2.0 * p.sigma]
    told = ", ".join(f"{p.name} {1e3 * p.value:+.1f} mrad/(N.m)" for p in soft) or "none"
    return model, (*left_out(postures, found), Verdict(STAGE, "ok", f"gears that give under load: {told}"))
