"""How robots depart from a rigid chain with constant zeros, as far as a hand model leaves it out; see `misfit`.

    load         dq_j = s tau_j / max |tau_j|                       compliance of the gears
    side         dq_j = s tanh(10 tau_j / max |tau_j|)              backlash and friction on the side of the load
    bending      frame j turned by s M_j / max |M|                  links, by gravity's moments across their joints;
                                                                    columns where they slid to
    wobble       frame j turned by s (1, cos q_j, sin q_j)          bearings and encoders out of centre
    eccentric    frame j moved by s (1, cos q_j, sin q_j)           the same, and lengths

about or along each axis; sizes s [rad, a tenth of it in m for joints that slide; m for `eccentric`]. Every group is
asked in every model: which of them count, and for how much, the residuals decide. The size expected beforehand is the
root mean square of the random errors that the fit found in the readings of joints that turn, 30 mrad where it has none.
"""

from dataclasses import dataclass, replace

import numpy as np

from calibration.inference.absorption import Absorption, absorption
from calibration.inference.family import Shown
from calibration.inference.map_estimate import Fit
from calibration.inference.misfit import Departures, misfit
from calibration.inference.mismatch import Effect, mismatch
from calibration.inference.parameters import ParameterSet
from calibration.mocap.postures import Postures
from calibration.numerics.lie import inverse, jlog6, log6, moved
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel
from calibration.robot.parameter_block import joint_lengths

NAMES = ("load", "side", "bending", "wobble", "eccentric")
_CLASSES = {"base body": "frame.base.", "hand body": "frame.tool.", "placements": "geometry.", "zeros": "encoder."}
_LOADED = 1e-3  # of the largest torque, below which a joint that turns bears none
_SHARP = 10.0
_UNKNOWN = 3e-2  # [rad]


@dataclass(frozen=True)
class Departed:
    """A fit and what its residuals show.

    Attributes:
        fit: With departures counted in its covariance.
        shown: What the residuals show, as messages.
        absorbed: How much of each class of defect the parameters swallow.
    """

    fit: Fit
    shown: tuple[str, ...]
    absorbed: Absorption


def with_departures(hand: HandModel, parameters: ParameterSet, fit: Fit, postures: Postures) -> Departed:
    """The fit of `parameters` of `hand` to postures, and the departures that are seen."""
    possible = departures(hand.with_theta(fit.theta, parameters.names), postures, _expected(hand, fit))
    found, absorbed = misfit(fit, parameters, possible), _absorbed(fit, parameters, possible)
    seen = ", ".join(f"{name} {1e3 * size:.2g} m{'m' if name == NAMES[-1] else 'rad'}" for name, size in found.seen)
    wider = replace(fit, covariance=found.covariance)
    if not found.size.any():
        return Departed(wider, (), absorbed)
    what = f"effects that the model leaves out ({seen or 'not clear which'})"
    return Departed(wider, (f"residuals show {what}; intervals are widened by them",), absorbed)


@dataclass(frozen=True)
class TakenForKnown:
    """Standard deviations of what a fit takes for known of drive trains and column; 0 of what there is none of.

    Attributes:
        compliance: (k,) of the joints' gears [rad/(N.m)].
        half_gap: (k,) of half their backlash [rad].
        bending: (2,) of the first joint's column [rad/(N.m)].
        leaning: (2,) how far the column leans about x and y in all postures alike, the place of its own centre of mass
            being known to a tolerance [rad].
        read: (k,) whether a link encoder reads the joint: of its drive train the zero of the motor alone is used.
    """

    compliance: np.ndarray
    half_gap: np.ndarray
    bending: np.ndarray
    leaning: np.ndarray
    read: np.ndarray


def with_gears(hand: HandModel, parameters: ParameterSet, fit: Fit, postures: Postures, known: TakenForKnown) -> Fit:
    """The fit with what it takes for known counted in its covariance, C + sum s^2 (K N) (K N)', K = H^-1 J'.

    N: in postures, deflection of each joint by the torque of gravity, and of the first joint's column by its moments,
    by those too that no posture changes; each joint on the side of its gap where its load has it, which a load that
    never changes its sign makes a zero. Of a joint that a link encoder reads, their mean: what its motor's zero is off
    by.
    """
    chain, at = hand.nominal, hand.with_theta(fit.theta, parameters.names)
    tau, M = chain.gravity_torques(postures.q), chain.gravity_moments(postures.q)
    found = at.kinematics(postures.q, tau)
    column = _turned(found.J_frame[:, :, 1:], chain, found.q)[:, :, 0, :2]
    bent = [column * (M[:, 0, :2] * known.bending)[:, None], column * known.leaning]
    deflections = [tau * known.compliance, np.sign(tau) * known.half_gap]
    gears = [found.J_joint * np.where(known.read, s.mean(axis=0), s)[:, None] for s in deflections]
    N = (fit.whitener @ _as_residuals(np.concatenate([*gears, *bent], axis=2), found.T, postures)).reshape(
        fit.r_white.size, -1
    )
    H = fit.J_white.T @ fit.J_white + np.diag(parameters.prior.precision(fit.widths.prior))
    moved = np.linalg.solve(H, fit.J_white.T @ N)
    return replace(fit, covariance=fit.covariance + moved @ moved.T)


def shown_by(hand: HandModel, parameters: ParameterSet, fit: Fit, postures: Postures) -> tuple[Shown, ...]:
    """Whether residuals depend on time, reversal, load and posture, joint by joint: dq_j = s x_j.

    x: order of recording; sign of the motion, or of the approach to a static posture; torque of gravity; cos q, sin q.
    """
    chain, at = hand.nominal, hand.with_theta(fit.theta, parameters.names)
    q, tau = postures.q[:, chain.columns], chain.gravity_torques(postures.q)
    J = _as_residuals(at.kinematics(postures.q, tau).J_joint * joint_lengths(chain), at.poses(postures.q), postures)
    turns = [k for k, name in enumerate(chain.joints) if not chain.is_prismatic(name)]
    order = np.linspace(-0.5, 0.5, len(q))[:, None] * np.ones(len(chain.joints))
    came = np.sign(np.diff(q, axis=0, prepend=q[:1]))
    load = tau / np.maximum(np.abs(tau).max(axis=0), _LOADED)
    shapes = (("time", order), ("reversal", came), ("load", load))
    effects = [Effect(name, J[:, :, turns] * x[:, None, turns]) for name, x in shapes]
    waves = [J[:, :, turns] * f(q)[:, None, turns] for f in (np.cos, np.sin)]
    effects.append(Effect("posture", np.concatenate(waves, axis=2)))
    moves = postures.motion >= 0
    return mismatch(fit, parameters, effects, np.where(moves, postures.motion, -1 - np.arange(len(q))))


def _expected(hand: HandModel, fit: Fit) -> float:
    """Root mean square of the random errors of joints that turn [rad]."""
    turning = [name for name in hand.nominal.joints if not hand.nominal.is_prismatic(name)]
    found = fit.noise_sigma(f"reading.{name}" for name in turning)
    return float(np.sqrt((found**2).mean())) if len(found) else _UNKNOWN


def _absorbed(fit: Fit, parameters: ParameterSet, possible: Departures) -> Absorption:
    """By classes of parameters, in units of their priors."""
    scale, precision = parameters.prior.scale, parameters.prior.precision(fit.widths.prior)
    J = fit.J_white * scale
    N = (fit.whitener @ possible.N).reshape(len(J), -1)
    starts = np.array(parameters.names, dtype=str)
    of = {name: np.flatnonzero(np.char.startswith(starts, start)) for name, start in _CLASSES.items()}
    of = {name: columns for name, columns in of.items() if len(columns)}
    own = {name: J[:, columns] for name, columns in of.items()}
    others = {name: N[:, possible.group == g] for g, name in enumerate(possible.names)}
    return absorption(own | others, of, precision * scale**2)


def departures(hand: HandModel, postures: Postures, expected: float) -> Departures:
    """Of the hand at postures, as the residuals of a fit of `hand` have it."""
    chain = hand.nominal
    tau, M = chain.gravity_torques(postures.q), chain.gravity_moments(postures.q)
    at = hand.kinematics(postures.q, tau)
    by_joint, by_frame = at.J_joint * joint_lengths(chain), at.J_frame[:, :, 1:]
    slides = np.array([chain.is_prismatic(name) for name in chain.joints])
    most = np.abs(tau).max(axis=0)
    loaded = slides | (most > _LOADED * np.abs(tau[:, ~slides]).max(initial=0.0))
    share = (tau / np.maximum(most, np.finfo(float).tiny))[:, loaded]
    bent = M / max(float(np.abs(M[:, ~slides]).max(initial=0.0)), np.finfo(float).tiny)
    waves = np.stack([np.ones_like(at.q), np.cos(at.q), np.sin(at.q)], axis=2)[:, ~slides]
    n, d = by_joint.shape[:2]
    found = (
        by_joint[:, :, loaded] * share[:, None],
        by_joint[:, :, loaded] * np.tanh(_SHARP * share)[:, None],
        (_turned(by_frame, chain, at.q) * bent[:, None]).reshape(n, d, -1),
        _waved(by_frame[:, :, ~slides, 3:], waves),
        _waved(by_frame[:, :, ~slides, :3], waves),
    )
    group = np.repeat(np.arange(len(found)), [part.shape[2] for part in found])
    return Departures(_as_residuals(np.concatenate(found, axis=2), at.T, postures), group, NAMES, expected)


def _turned(J: np.ndarray, chain: Chain, q: np.ndarray) -> np.ndarray:
    """(n, 6, k, 3) by turning each frame, J (n, 6, k, 6) by moving and turning it: one that slides where it slid to.

    About a point d away: w x (p - d) = w x p - w x d
    """
    turned = J[..., 3:].copy()
    for j in (j for j, name in enumerate(chain.joints) if chain.is_prismatic(name)):
        axis = chain.loads.axis[list(chain.loads.column).index(chain.columns[j])]
        turned[:, :, j] -= (J[:, :, j, :3] @ np.cross(np.eye(3), axis).T) * q[:, None, j, None]
    return turned


def _waved(J: np.ndarray, waves: np.ndarray) -> np.ndarray:
    """(n, 6, k * 3 * 3) of J (n, 6, k, 3) times each of waves (n, k, 3)."""
    return np.asarray((J[..., None] * waves[:, None, :, None]).reshape(*J.shape[:2], -1))


def _as_residuals(J: np.ndarray, T: np.ndarray, postures: Postures) -> np.ndarray:
    """Local twists J (n, 6, m) of the hand at T (n, 4, 4) as changes of the residual (n, d, m)."""
    if postures.components == 3:
        return moved(T[:, :3, :3], J, postures.point)
    return np.asarray(jlog6(log6(inverse(postures.T_base_hand) @ T)) @ J)
