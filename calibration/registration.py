"""Stage `registration`: nominal geometry, the two marker bodies placed where the data say.

    minimise  sum_i |log6(T_measured_i^-1 T_base_B^-1 T_base_tool(q_i) T_tool_H)|^2 / tolerance^2      12 parameters

The honest baseline: what is left after it is geometry, zeros, play and the base. Those errors are millimetres where the
markers' noise is a tenth of one, so position and rotation weigh as the datasheet's tolerance of a marker body does, and
postures passed through in swings count beside the static ones: a baseline must not hang on where the statics lie.
With the arm alone moving, all twelve are identifiable once it turns about two directions; where the base stands in the
lab is not asked.
"""

from dataclasses import replace

import numpy as np

from calibration.estimate import Model
from calibration.hand import nominal_hand
from calibration.hand_fit import fit_weighted
from calibration.parameters import registration_parameters
from calibration.postures import Postures
from calibration.result import model_of
from calibration.robot import Chain
from calibration.schema import Description
from calibration.verdict import Verdict

STAGE = "registration"


def register(chain: Chain, description: Description, postures: Postures) -> tuple[Model, tuple[Verdict, ...]]:
    """The two frames, and what is to be said of them."""
    parameters, tol = registration_parameters(chain, description), description.tolerances
    told = 6 + postures.components  # a point does not show how the hand is turned: that stays as drawn
    drawn = np.where(np.arange(12) < told, parameters.tolerance, tol.body_rotation)
    parameters = replace(parameters, tolerance=drawn)
    W = np.diag(1.0 / np.repeat([tol.body_translation, tol.body_rotation], 3)[: postures.components])
    found = fit_weighted(
        nominal_hand(chain, parameters.nominal), parameters, postures, np.tile(W, (len(postures), 1, 1))
    )
    model = model_of(STAGE, chain, parameters, found)
    if not found.converged:
        return model, (Verdict(STAGE, "warning", "the fit of the two marker frames did not come to rest"),)
    if model.rank < told:
        message = (
            f"{told - model.rank} of {told} directions are not identified: the arm turned about one direction only, "
            "so a turn of both frames about it cannot be told apart; move another joint"
        )
        return model, (Verdict(STAGE, "warning", message),)
    shift = 1e3 * np.linalg.norm(found.theta[6:9] - parameters.nominal[6:9])
    message = f"marker frames from {len(postures)} postures; hand {shift:.1f} mm from its drawing"
    return model, (Verdict(STAGE, "ok", message),)
