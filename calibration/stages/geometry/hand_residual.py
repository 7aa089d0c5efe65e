"""The hand model fitted to static postures: residuals, sources of random errors, priors.

    r_i = log6(T_measured_i^-1 T_B_H(q_i, theta))       local twist [m, rad], where the hand's pose was measured
    r_i = p_B_c(q_i, theta) - p_measured_i              [m, base body's axes], where a point c of it was

Random errors: each joint's reading along its lever arms, the hand's position and rotation where asked for, the markers.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from calibration.inference.map_estimate import Fit, Problem, solve
from calibration.inference.marginal_likelihood import Linearised, Noise, Widths
from calibration.inference.parameters import ParameterSet
from calibration.mocap.postures import Postures
from calibration.numerics.lie import inverse, jlog6, log6, moved, places
from calibration.robot.hand import HandModel


@dataclass(frozen=True)
class Errors:
    """Random errors to begin with, and the least of each, standard deviations.

    Attributes:
        play: (k,) of the joints' readings [rad, m].
        floor: (k,) least of them: the encoders' own noise.
        pose: Of the hand's position [m] and rotation [rad], (2,); empty where all is left to joints and markers.
        stated: The joints' are a datasheet's, so that none is dropped as needless.
    """

    play: np.ndarray
    floor: np.ndarray
    pose: np.ndarray
    stated: bool = False


def fit(model: HandModel, parameters: ParameterSet, postures: Postures, play: np.ndarray, floor: np.ndarray) -> Fit:
    """Fit the parameters of `model`, the first of its theta, from their nominal values.

    Args:
        model: Nominal robot.
        parameters: What is estimated and its priors.
        postures: The data.
        play: (k,) start value of the joints' random errors [rad, m].
        floor: (k,) least of them: the encoders' own noise [rad, m].
    """
    errors = Errors(np.maximum(play, floor), floor, np.zeros(0))
    problem = hand_problem(model, parameters, postures, errors)
    return solve(problem, problem.linearise(parameters.nominal))


def hand_problem(
    model: HandModel, parameters: ParameterSet, postures: Postures, errors: Errors, tau: np.ndarray | None = None
) -> Problem:
    """The problem of `fit`, with the hand's own random errors where they are given; tau as the model takes it."""
    tau = model.chain.gravity_torques(postures.q) if tau is None else tau
    roots = np.linalg.cholesky(postures.covariance)
    k, n_pose = len(errors.play), len(errors.pose)
    pose = np.repeat(np.arange(n_pose), 3)
    group = np.concatenate([np.arange(k), k + pose, np.full(postures.covariance.shape[1], k + n_pose)])
    floor = np.concatenate([errors.floor, 1e-2 * errors.pose, [1.0]])
    free = np.arange(k + n_pose + 1) < k + n_pose
    eye = np.eye(6)[: postures.covariance.shape[1], : 3 * n_pose]

    def sources(at: Linearised) -> Noise:
        still = np.broadcast_to(eye, (len(at.r), *eye.shape))
        return Noise(np.concatenate([at.J_joint, still, roots], axis=2), group, floor, free, np.ones(len(at.r)))

    widths = Widths(np.concatenate([errors.play, errors.pose, [1.0]]), np.ones(parameters.prior.n_groups))
    at = partial(linearised, model, postures=postures, tau=tau)
    return Problem(at, sources, parameters.prior, widths, errors.stated)


def fit_weighted(model: HandModel, parameters: ParameterSet, postures: Postures, W: np.ndarray) -> Fit:
    """Fit with given whiteners W (n, d, d) and no random errors of the joints; sigma from the residuals' own size."""
    roots, k = np.linalg.inv(W), len(model.offset)
    still = np.append(np.zeros(k), 1.0)

    def sources(at: Linearised) -> Noise:
        return Noise(roots, np.full(W.shape[1], k), np.ones(k + 1), np.zeros(k + 1, dtype=bool), np.ones(len(at.r)))

    prior = replace(parameters, group=None).prior
    problem = Problem(lambda theta: linearised(model, theta, postures), sources, prior, Widths(still, np.zeros(0)))
    found = solve(problem, problem.linearise(parameters.nominal))
    factor = float((found.r_white**2).sum()) / max(1, found.r_white.size - len(parameters))
    return replace(found, covariance=factor * found.covariance)


def linearised(model: HandModel, theta: np.ndarray, postures: Postures, tau: np.ndarray | None = None) -> Linearised:
    """Residuals and derivatives by theta, the first (p,) of the model's parameters; tau as the model takes it."""
    found = model.with_theta(theta).poses_and_derivatives(postures.q, tau, len(theta))
    if postures.components == 3:
        R, c = found.T[:, :3, :3], postures.point
        r = places(found.T, c) - postures.T_base_hand[:, :3, 3]
        return Linearised(theta, r, moved(R, found.J, c), moved(R, found.J_joint, c))
    r = log6(inverse(postures.T_base_hand) @ found.T)
    J_log = jlog6(r)
    return Linearised(theta, r, J_log @ found.J, J_log @ found.J_joint)
