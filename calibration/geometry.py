"""Stage `geometry`: joint placements, zeros of the readings and marker frames, datasheet tolerances as priors.

See `map_fit` for the cost and `hand` for the model. With 6D markers on base and hand a chain of R revolute and P
prismatic joints has 4 R + 2 P + 6 identifiable combinations: 36 for a torso and seven arm joints, 34 with the torso
still. What the data do not separate stays at what the tolerances make most likely.
"""

from collections.abc import Iterator

import numpy as np

from calibration.estimate import Model
from calibration.geometry_guards import distinct, joint_lengths
from calibration.hand import nominal_hand
from calibration.hand_fit import fit
from calibration.identifiability import Identifiability, identifiability
from calibration.map_fit import Fit
from calibration.parameters import ParameterSet, geometry_parameters, play_floor, play_start
from calibration.postures import Postures
from calibration.result import model_of
from calibration.robot import Chain
from calibration.schema import Description
from calibration.verdict import Verdict

STAGE = "geometry"
_APART = 0.05  # [rad, a tenth of it in m] postures closer than this in every joint are one
_CONDITION = 2e4  # scaled; 200 to 900 for postures spread over the workspace [-]
_OFFSET = 0.5  # largest believable zero of a reading [rad, a tenth of it in m]
_TOLERANCES = 10.0  # largest believable deviation from nominal, and play, in datasheet tolerances [-]
_CHI2 = 3.0  # largest believable squared whitened residual per degree of freedom [-]


def calibrate_geometry(chain: Chain, description: Description, postures: Postures) -> tuple[Model, tuple[Verdict, ...]]:
    """The geometric model; a verdict `refused` says that it must not be used."""
    parameters = geometry_parameters(chain, description)
    start = play_start(chain, description)
    found = fit(
        nominal_hand(chain, parameters.nominal[:12]), parameters, postures, start, play_floor(chain, description)
    )
    known = identifiability(found.J_white, parameters)
    refused = [
        *_too_little(chain, postures, known),
        *_implausible(parameters, found, start, chain),
    ]
    verdicts = [Verdict(STAGE, "refused", message) for message in refused]
    still = [name for name, span in zip(chain.joints, _spans(chain, postures), strict=True) if span < _APART]
    if still:
        verdicts.append(
            Verdict(STAGE, "warning", f"joints that never moved are calibrated at their position only: {still}")
        )
    if not refused:
        message = f"{known.rank} combinations of {len(parameters)} parameters from {len(postures)} postures"
        verdicts.append(Verdict(STAGE, "ok", f"{message}, condition {known.condition:.0f}"))
    return model_of("model_2", chain, parameters, found), tuple(verdicts)


def _spans(chain: Chain, postures: Postures) -> np.ndarray:
    return np.ptp(postures.q[:, chain.columns], axis=0) / joint_lengths(chain)


def _too_little(chain: Chain, postures: Postures, known: Identifiability) -> Iterator[str]:
    """Why the postures cannot carry the model."""
    needed = int(np.ceil(2 * (6 + 4 * len(chain.joints)) / 6))
    n = distinct(postures.q[:, chain.columns], _APART * joint_lengths(chain))
    if n < needed:
        yield f"{n} distinct postures among {len(postures)}; at least {needed} are needed, spread over all joints"
    if not known.clear or known.condition > _CONDITION:
        yield (
            f"the postures do not excite the model (rank {known.rank}, gap {known.gap:.0f}, condition "
            f"{known.condition:.1e}); spread them over all joints' ranges"
        )


def _implausible(parameters: ParameterSet, found: Fit, play: np.ndarray, chain: Chain) -> Iterator[str]:
    """Why the values cannot be true."""
    if not found.converged:
        yield "the fit did not converge: model and data do not belong together"
    p, k = len(parameters), len(chain.joints)
    off = np.abs(found.theta - parameters.nominal)
    limit = np.append(_TOLERANCES * parameters.tolerance[: p - k], _OFFSET * joint_lengths(chain))
    for i in np.flatnonzero(off > limit):
        yield f"{parameters.names[i]} = {found.theta[i]:.3g} {parameters.units[i]} is beyond belief ({limit[i]:.2g})"
    for name, s, limit_s in zip(chain.joints, found.play, _TOLERANCES * play, strict=True):
        if s > limit_s:
            yield f"readings of {name} scatter by {s:.2g}, datasheet play is {limit_s / _TOLERANCES:.2g}; units, order?"
    chi2 = float((found.r_white**2).sum()) / max(1, found.r_white.size - 36)
    if chi2 > _CHI2:
        yield f"residuals are {np.sqrt(chi2):.1f} times what noise and play explain"
