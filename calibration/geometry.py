"""Stage `geometry`: joint placements, zeros of the readings and marker frames, datasheet tolerances as priors.

See `map_fit` for the cost and `hand` for the model. With 6D markers on base and hand a chain of R revolute and P
prismatic joints has 4 R + 2 P + 6 identifiable combinations: 36 for a torso and seven arm joints, 34 with the torso
still. What the data do not separate stays at what the tolerances make most likely. Postures that contradict all others
are left out and named.

What gears give under load, and the play that gravity holds, is asked for in row `full`, see `gears`.
"""

from collections.abc import Iterator

import numpy as np

from calibration.estimate import Model
from calibration.geometry_guards import MANY_ODD, joint_lengths, unusable_data
from calibration.hand import nominal_hand
from calibration.hand_fit import Errors, hand_problem
from calibration.identifiability import Identifiability, identifiability
from calibration.map_fit import Fit
from calibration.marker_shape import of_one_shape
from calibration.parameters import ParameterSet, geometry_parameters, play_floor, play_start
from calibration.postures import Postures
from calibration.registration_start import registration_start
from calibration.result import model_of
from calibration.robot import Chain
from calibration.robust import RobustFit, robust_fit
from calibration.schema import Description
from calibration.verdict import Verdict

STAGE = "geometry"
_APART = 0.05  # [rad, a tenth of it in m] postures closer than this in every joint are one
_CONDITION = {6: 2e4, 3: 1e6}  # scaled, of poses and of points; 200 to 900 for poses all over the workspace [-]
_OFFSET = 0.5  # largest believable zero of a reading [rad, a tenth of it in m]
_TOLERANCES = 10.0  # largest believable deviation from nominal, and play, in datasheet tolerances [-]
_CHI2 = 3.0  # largest believable squared whitened residual per degree of freedom [-]


def calibrate_geometry(chain: Chain, description: Description, postures: Postures) -> tuple[Model, tuple[Verdict, ...]]:
    """The geometric model; a verdict `refused` says that it must not be used."""
    parameters = geometry_parameters(chain, description)
    start, floor = play_start(chain, description), play_floor(chain, description)
    errors = Errors(np.maximum(start, floor), floor, np.zeros(0), stated=True)
    robust = fit_robustly(chain, parameters, postures, errors)
    found = robust.fit
    known = identifiability(found.J_white, parameters)
    oriented = postures.components == 6
    frames = registration_start(chain.poses(postures.q), postures.T_base_hand, oriented)
    refused = [*unusable_data(chain, postures.q, frames, postures.components)]
    refused = refused or [
        *_too_little(known, _CONDITION[postures.components]),
        *_implausible(parameters, found, start, chain),
    ]
    verdicts = [Verdict(STAGE, "refused", message) for message in refused]
    verdicts += left_out(postures, robust)
    still = [name for name, span in zip(chain.joints, _spans(chain, postures), strict=True) if span < _APART]
    if still:
        verdicts.append(
            Verdict(STAGE, "warning", f"joints that never moved are calibrated at their position only: {still}")
        )
    if not refused:
        used = int(robust.kept.sum())
        message = f"{known.rank} combinations of {len(parameters)} parameters from {used} postures"
        verdicts.append(Verdict(STAGE, "ok", f"{message}, condition {known.condition:.0f}"))
    if not oriented:
        message = "a point of the hand was seen: its place is calibrated, which way the hand is turned is as drawn"
        verdicts.append(Verdict(STAGE, "warning", f"{message}; put three markers on it"))
    return model_of("model_2", chain, parameters, found), tuple(verdicts)


def fit_robustly(chain: Chain, parameters: ParameterSet, postures: Postures, errors: Errors) -> RobustFit:
    """The fit of the postures that agree, from nominal values; none whose markers do not have their body's shape."""
    nominal, n = nominal_hand(chain, parameters.nominal[:12]), len(postures)
    rigid = np.flatnonzero(of_one_shape(postures.misfit))
    found = robust_fit(
        lambda some: hand_problem(nominal, parameters, postures.rows(rigid[some]), errors),
        len(rigid),
        postures.components,
        parameters.nominal,
    )
    kept, distance = np.zeros(n, dtype=bool), np.full(n, np.inf)
    kept[rigid], distance[rigid] = found.kept, found.distance
    return RobustFit(found.fit, kept, distance)


def left_out(postures: Postures, found: RobustFit) -> Iterator[Verdict]:
    """The postures that were not used, by name."""
    odd = np.flatnonzero(~found.kept)
    if len(odd):
        names = ", ".join(postures.label[odd] if len(postures.label) else odd.astype(str))
        said = (
            f"{len(odd)} of {len(postures)} postures contradict the others and were left out, counted from 0: {names}"
        )
        yield Verdict(STAGE, "refused" if len(odd) > MANY_ODD * len(postures) else "warning", said)


def _spans(chain: Chain, postures: Postures) -> np.ndarray:
    return np.ptp(postures.q[:, chain.columns], axis=0) / joint_lengths(chain)


def _too_little(known: Identifiability, limit: float) -> Iterator[str]:
    """Why the postures cannot carry the model."""
    if not known.clear or known.condition > limit:
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
