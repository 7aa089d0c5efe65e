"""Why a geometric calibration from arrays must not be used; each finding once, with what was found and what to do."""

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
READING = 0.03  # largest plausible random error of a reading [rad, a tenth of it in m]
MANY_ODD = 0.25  # share of postures that may be wrong
TOO_FEW, DEFICIENT = "distinct postures among", "the postures do not excite the model"
_HAND = (("position [m]", 1e-2), ("rotation [rad]", 5e-2))  # largest plausible random errors of the hand
CONDITION = {6: 2e4, 3: 1e6}  # scaled, of poses and of points; 200 to 900 for poses all over the workspace [-]
_OFFSET = 0.5  # largest plausible zero of a reading [rad, a tenth of it in m]
_TOLERANCES = 10.0  # largest plausible deviation from nominal, and play, in datasheet tolerances [-]
_LEVER = 0.1  # [m] from its axis at which a joint's random error shows in full in a point of the hand
_CHI2 = 3.0  # largest plausible squared whitened residual per degree of freedom [-]


def groups(q: np.ndarray, apart: np.ndarray) -> np.ndarray:
    """Number (n,) of the distinct posture each of q (n, k) repeats: the first within `apart` (k,) in every joint."""
    first: list[np.ndarray] = []
    found = np.empty(len(q), dtype=int)
    for i, row in enumerate(q):
        near = (k for k, other in enumerate(first) if not (np.abs(row - other) > apart).any())
        found[i] = next(near, len(first))
        if found[i] == len(first):
            first.append(row)
    return found


def distinct(q: np.ndarray, apart: np.ndarray) -> int:
    """Number of postures q (n, k) that differ from all earlier counted ones by `apart` (k,)."""
    return len(set(groups(q, apart)))


def recommended(chain: Chain, components: int) -> int:
    """Distinct postures with twice as many equations as a geometry has combinations; with fewer, priors decide most."""
    return int(np.ceil(2 * (6 + 4 * len(chain.joints)) / components))


def fewest(components: int) -> int:
    """Distinct postures with twice as many equations as the two frames have unknowns."""
    return 2 * (6 + components) // components


def few(chain: Chain, postures: Postures) -> bool:
    """Whether priors decide most of a geometry: what the postures do not excite stays near nominal."""
    needed = recommended(chain, postures.components)
    return distinct(postures.q[:, chain.columns], APART * joint_lengths(chain)) < needed


def unusable_data(chain: Chain, q: np.ndarray, start: Start, components: int) -> Iterator[str]:
    """What is wrong with readings q (n, n_measured) and a start made from them, `components` measured a posture."""
    yield from implausible_readings(chain, q)
    needed = fewest(components)
    n = distinct(q[:, chain.columns], APART * joint_lengths(chain))
    if n < needed:
        yield f"{n} {TOO_FEW} {len(q)}; at least {needed} are needed, spread over all joints"
        return
    size = abs(start.scale)
    if not 1.0 / _SCALE < size < _SCALE:
        unit = " (markers recorded in millimetres?)" if 5e-4 < size < 2e-3 else ""
        unit += f" of {n} distinct postures, which are few" if n < recommended(chain, components) else ""
        yield f"the robot is {size:.3g} times as large as by the markers' paths{unit}; units, joint order, tool frame?"
    elif start.scale < 0.0:
        yield "the markers move as in a mirror: the laboratory's frame is left-handed; swap two axes or turn one"


def unusable_fit(
    hand: HandModel, parameters: ParameterSet, found: RobustFit, known: Identifiability, postures: Postures
) -> Iterator[str]:
    """Why the values cannot be true."""
    fit, n = found.fit, len(postures)
    if not fit.converged:
        yield "the fit did not converge; check joint order, units, tool frame"
    if not few(hand.nominal, postures):
        yield from too_little(known, _CONDITION_OF_COMPLIANCES)
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
    reading = fit.noise_sigma(reading_names(hand.nominal))
    for joint, s, length, seen in zip(joints, reading, lengths, _seen(fit, len(joints)), strict=True):
        if s * seen > READING * length:
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
            f"{DEFICIENT} (rank {known.rank}, gap {known.gap:.0f}, condition "
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
    reading, joints = found.noise_sigma(reading_names(hand.nominal)), hand.nominal.joints
    for name, s, limit_s, seen in zip(joints, reading, _TOLERANCES * play, _seen(found, len(joints)), strict=True):
        if s * seen > limit_s:
            yield f"readings of {name} scatter by {s:.2g}, tolerance is {limit_s / _TOLERANCES:.2g}; units, order?"
    fitted = float(np.trace(found.covariance @ found.J_white.T @ found.J_white))  # as many residuals theta takes
    chi2 = float((found.r_white**2).sum()) / max(1.0, found.r_white.size - fitted)
    if chi2 > _CHI2:
        yield f"residuals are {np.sqrt(chi2):.1f} times what noise and backlash explain"


def _seen(found: Fit, k: int) -> np.ndarray:
    """Share (k,) of a joint's random error that a point of the hand shows: one on its axis does not move with it."""
    if found.at.r.shape[1] > 3:
        return np.ones(k)
    lever = np.sqrt((found.at.B[:, :, :k] ** 2).sum(axis=1).mean(axis=0))
    return np.asarray(np.minimum(1.0, lever / _LEVER))
