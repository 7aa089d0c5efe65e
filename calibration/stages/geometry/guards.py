"""Why a geometric calibration from arrays must not be used; each finding once, with what was found and what to do."""

import sys
from collections.abc import Iterator

import numpy as np

from calibration.checks.joint_readings import implausible_readings
from calibration.inference.identifiability import Identifiability
from calibration.inference.map_estimate import Fit
from calibration.inference.outliers import RobustFit
from calibration.inference.parameters import ParameterSet
from calibration.mocap.postures import Postures
from calibration.numerics.alignment import Start
from calibration.robot.blocks import EncoderZeros
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel
from calibration.robot.parameter_block import joint_lengths
from calibration.stages.geometry.hand_residual import HAND_NAMES
from calibration.stages.geometry.parameters import reading_names

_SCALE = 1.2  # plausible ratio of the robot's size to the measured one, or its inverse [-]
APART = 0.05  # [rad, a tenth of it in m] postures closer than this in every joint are one
_CONDITION_OF_COMPLIANCES = 1e6  # scaled [-]
_FACTOR = 6.0  # largest plausible ratio of a prior's width to what it began with [-]
_READING = 0.03  # largest plausible random error of a reading [rad, a tenth of it in m]
MANY_ODD = 0.25  # share of postures that may be wrong
_HAND = (("position [m]", 1e-2), ("rotation [rad]", 5e-2))  # largest plausible random errors of the hand
CONDITION = {6: 2e4, 3: 1e6}  # scaled, of poses and of points; 200 to 900 for poses all over the workspace [-]
_OFFSET = 0.5  # largest plausible zero of a reading [rad, a tenth of it in m]
_TOLERANCES = 10.0  # largest plausible deviation from nominal, and play, in datasheet tolerances [-]
_CHI2 = 3.0  # largest plausible squared whitened residual per degree of freedom [-]


def distinct(q: np.ndarray, apart: np.ndarray, enough: int = sys.maxsize) -> int:
    """Number of postures q (n, k) that differ from all earlier counted ones by `apart` (k,), counted up to `enough`."""
    kept: list[np.ndarray] = []
    for row in q:
        if len(kept) == enough:
            break
        if all((np.abs(row - other) > apart).any() for other in kept):
            kept.append(row)
    return len(kept)


def fewest(chain: Chain, components: int) -> int:
    """Distinct postures a geometry needs, twice as many equations as it has combinations."""
    return int(np.ceil(2 * (6 + 4 * len(chain.joints)) / components))


def unusable_data(chain: Chain, q: np.ndarray, start: Start, components: int) -> Iterator[str]:
    """What is wrong with readings q (n, n_measured) and a start made from them, `components` measured a posture."""
    yield from implausible_readings(chain, q)
    needed = fewest(chain, components)
    n = distinct(q[:, chain.columns], APART * joint_lengths(chain), needed)
    if n < needed:
        yield f"{n} distinct postures among {len(q)}; at least {needed} are needed, spread over all joints"
        return
    size = abs(start.scale)
    if not 1.0 / _SCALE < size < _SCALE:
        unit = " (markers recorded in millimetres?)" if 5e-4 < size < 2e-3 else ""
        yield f"the robot is {size:.3g} times as large as the markers' paths say{unit}; units, joint order, tool frame?"
    elif start.scale < 0.0:
        yield "the markers move as in a mirror: the laboratory's frame is left-handed; swap two axes or turn one"


def unusable_fit(
    hand: HandModel, parameters: ParameterSet, found: RobustFit, known: Identifiability, n: int
) -> Iterator[str]:
    """Why the values cannot be true."""
    fit = found.fit
    if not fit.converged:
        yield "the fit did not converge; check joint order, units, tool frame"
    if not known.clear or known.condition > _CONDITION_OF_COMPLIANCES:
        yield (
            f"the postures do not excite the model (rank {known.rank}, gap {known.gap:.0f}, condition "
            f"{known.condition:.1e}); spread them over all joints' ranges"
        )
    yield from _implausible_values(hand, parameters, fit)
    if fit.widths.prior.max(initial=0.0) > _FACTOR**2:
        times = np.sqrt(fit.widths.prior.max())
        yield f"placement errors are {times:.0f} times their prior standard deviation; units, joint order, tool frame?"
    wrong = n - int(found.kept.sum())
    if wrong > MANY_ODD * n:
        yield f"{wrong} of {n} postures contradict the others; more than mistakes of some rows"


def _implausible_values(hand: HandModel, parameters: ParameterSet, fit: Fit) -> Iterator[str]:
    """Zeros and random errors beyond what robots have."""
    joints, lengths = hand.nominal.joints, joint_lengths(hand.nominal)
    zeros = hand.block(EncoderZeros).names
    for name, offset, length in zip(zeros, fit.theta[parameters.indices(zeros)], lengths, strict=True):
        if abs(offset) > _OFFSET * length:
            yield f"{name} = {offset:.3g} exceeds the plausible {_OFFSET * length:.2g}; readings of another joint?"
    for joint, s, length in zip(joints, fit.noise_sigma(reading_names(hand.nominal)), lengths, strict=True):
        if s > _READING * length:
            yield f"readings of {joint} scatter by {s:.2g}; units, order of the joints, tool frame?"
    for (what, limit), s in zip(_HAND, fit.noise_sigma(HAND_NAMES), strict=False):
        if s > limit:
            yield f"the hand's {what} scatters by {s:.2g}: the model does not explain it; frames, orientations?"


def spans(chain: Chain, postures: Postures) -> np.ndarray:
    """Range of each joint over the postures (k,) [rad, a tenth of it in m]."""
    return np.ptp(postures.q[:, chain.columns], axis=0) / joint_lengths(chain)


def too_little(known: Identifiability, limit: float) -> Iterator[str]:
    """Why the postures cannot carry the model."""
    if not known.clear or known.condition > limit:
        yield (
            f"the postures do not excite the model (rank {known.rank}, gap {known.gap:.0f}, condition "
            f"{known.condition:.1e}); spread them over all joints' ranges"
        )


def implausible(parameters: ParameterSet, found: Fit, play: np.ndarray, hand: HandModel) -> Iterator[str]:
    """Why the values cannot be true."""
    if not found.converged:
        yield "the fit did not converge; check joint order, units, tool frame"
    off, limit = np.abs(found.theta - parameters.nominal), _TOLERANCES * parameters.tolerance
    limit[parameters.indices(hand.block(EncoderZeros).names)] = _OFFSET * joint_lengths(hand.nominal)
    for i in np.flatnonzero(off > limit):
        name, unit = parameters.names[i], parameters.units[i]
        yield f"{name} = {found.theta[i]:.3g} {unit} exceeds {limit[i]:.2g}, the plausible limit"
    reading = found.noise_sigma(reading_names(hand.nominal))
    for name, s, limit_s in zip(hand.nominal.joints, reading, _TOLERANCES * play, strict=True):
        if s > limit_s:
            yield f"readings of {name} scatter by {s:.2g}, datasheet play is {limit_s / _TOLERANCES:.2g}; units, order?"
    chi2 = float((found.r_white**2).sum()) / max(1, found.r_white.size - 36)
    if chi2 > _CHI2:
        yield f"residuals are {np.sqrt(chi2):.1f} times what noise and play explain"
