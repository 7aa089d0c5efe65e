"""Maximum a posteriori fit of a hand model to static postures, with the joints' random reading errors estimated too.

    r_i(theta) = log6(T_measured_i^-1 T_B_H(q_i, theta))                local twist of the hand [m, rad]
    minimise  sum_i r_i' C_i^-1 r_i  +  sum_j ((theta_j - nominal_j) / tolerance_j)^2
    C_i = S_i + Jq_i diag(s^2) Jq_i'

S_i is the measured pose's covariance, s_j the random error of joint j's reading (play, friction: what no constant
describes), carried to the hand by that posture's own lever arms. s maximises the evidence of the data linearised at
theta (type-II maximum likelihood), theta integrated out; then theta is fitted again.
References: MacKay, Neural Computation 1992; Hollerbach, Khalil, Gautier, Springer Handbook of Robotics, ch. 6.
"""

import logging
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from calibration.hand import HandModel
from calibration.parameters import ParameterSet
from calibration.postures import Postures
from calibration.se3 import inverse
from calibration.twists import jlog6, log6

_OUTER, _NEWTON = 25, 50
_PROMISE = 1e-10  # Gauss-Newton stops when a step promises a smaller decrease of the cost [-]: 1e-5 sigma
_LARGEST = 1.0  # of s [rad, m]: data that ask for more do not belong to the model
_SAME = 1e-3  # outer iterations stop below this change of log s [-]
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Linearised:
    """The problem at one theta.

    Attributes:
        theta: (p,).
        r: (n, 6) residuals [m, rad].
        J: (n, 6, p) their derivatives.
        J_joint: (n, 6, k) by joint position.
    """

    theta: np.ndarray
    r: np.ndarray
    J: np.ndarray
    J_joint: np.ndarray


@dataclass(frozen=True)
class Fit:
    """Result of a fit.

    Attributes:
        at: The problem at the solution.
        play: (k,) random reading error of each joint, standard deviation [rad, m].
        covariance: (p, p) of theta.
        whitener: (n, 6, 6) W with W' W = C^-1.
        converged: Whether both theta and s stood still.
    """

    at: Linearised
    play: np.ndarray
    covariance: np.ndarray
    whitener: np.ndarray
    converged: bool

    @property
    def theta(self) -> np.ndarray:
        """Estimated parameters (p,)."""
        return self.at.theta

    @property
    def J_white(self) -> np.ndarray:
        """Whitened Jacobian (6 n, p)."""
        return (self.whitener @ self.at.J).reshape(-1, len(self.theta))

    @property
    def r_white(self) -> np.ndarray:
        """Whitened residuals (n, 6) [-]."""
        return np.einsum("nij,nj->ni", self.whitener, self.at.r)


def fit(model: HandModel, parameters: ParameterSet, postures: Postures, play: np.ndarray, floor: np.ndarray) -> Fit:
    """Fit the parameters of `model` (12: frames alone; else all) from their nominal values.

    Args:
        model: Nominal robot.
        parameters: What is estimated and its priors.
        postures: The data.
        play: (k,) start value of s [rad, m].
        floor: (k,) smallest s: an encoder's own noise [rad, m].
    """
    at, s, converged = linearised(model, parameters.nominal, postures), np.maximum(play, floor), False
    for _ in range(_OUTER):
        at, still = _newton(model, parameters, postures, at, whiteners(at, postures, s))
        s_new = _evidence(at, parameters, postures, s, floor)
        change = float(np.abs(np.log(np.maximum(s_new, 10.0 * floor) / np.maximum(s, 10.0 * floor))).max())
        s = s_new
        if still and change < _SAME:
            converged = True
            break
    W = whiteners(at, postures, s)
    at, still = _newton(model, parameters, postures, at, W)
    _log.info("fit of %d parameters to %d postures: s = %s, converged %s", len(parameters), len(postures), s, converged)
    result = Fit(at, s, np.zeros((0, 0)), W, converged and still)
    return replace(result, covariance=_covariance(result.J_white, parameters))


def fit_weighted(model: HandModel, parameters: ParameterSet, postures: Postures, W: np.ndarray) -> Fit:
    """Fit with given whiteners W (n, 6, 6), no random errors of the joints; sigma from the residuals' own size."""
    at, still = _newton(model, parameters, postures, linearised(model, parameters.nominal, postures), W)
    result = Fit(at, np.zeros(at.J_joint.shape[2]), np.zeros((0, 0)), W, still)
    dof = max(1, result.r_white.size - len(parameters))
    factor = float((result.r_white**2).sum()) / dof
    return replace(result, covariance=factor * _covariance(result.J_white, parameters))


def linearised(model: HandModel, theta: np.ndarray, postures: Postures) -> Linearised:
    """Residuals and derivatives at theta (p,), p = 12 or all."""
    found = model.with_theta(theta).poses_and_derivatives(postures.q)
    r = log6(inverse(postures.T_base_hand) @ found.T)
    J_log = jlog6(r)
    return Linearised(theta, r, J_log @ found.J[:, :, : len(theta)], J_log @ found.J_joint)


def whiteners(at: Linearised, postures: Postures, s: np.ndarray) -> np.ndarray:
    """W (n, 6, 6) with W' W = (S + Jq diag(s^2) Jq')^-1."""
    C = postures.covariance + (at.J_joint * s**2) @ np.swapaxes(at.J_joint, 1, 2)
    return np.linalg.inv(np.linalg.cholesky(C))


def _newton(
    model: HandModel, parameters: ParameterSet, postures: Postures, at: Linearised, W: np.ndarray
) -> tuple[Linearised, bool]:
    """Gauss-Newton with step halving at fixed weights, and whether it came to rest."""
    scale, prior = parameters.scale, 1.0 / parameters.tolerance

    def cost(x: Linearised) -> float:
        return float(((W @ x.r[..., None]) ** 2).sum() + ((prior * (x.theta - parameters.nominal)) ** 2).sum())

    now = cost(at)
    for _ in range(_NEWTON):
        A = np.vstack([(W @ at.J).reshape(-1, len(scale)) * scale, np.diag(prior * scale)])
        b = np.concatenate([(W @ at.r[..., None]).ravel(), prior * (at.theta - parameters.nominal)])
        z = np.linalg.lstsq(A, b, rcond=None)[0]
        if float(((A @ z) ** 2).sum()) < _PROMISE:
            return at, True
        step = -scale * z
        for _ in range(12):
            trial = linearised(model, at.theta + step, postures)
            if cost(trial) <= now:
                break
            step = 0.5 * step
        else:
            return at, False
        at, now = trial, cost(trial)
    return at, False


def _evidence(
    at: Linearised, parameters: ParameterSet, postures: Postures, s: np.ndarray, floor: np.ndarray
) -> np.ndarray:
    """The s (k,) of highest evidence for the problem linearised at theta: quasi-Newton in log s, down to `floor`."""
    bounds = [(low, np.log(_LARGEST)) for low in np.log(floor)]
    found = minimize(
        _minus_log_evidence, np.log(s), (at, parameters, postures), "L-BFGS-B", jac=True, bounds=bounds,
        options={"maxiter": 200, "ftol": 1e-13, "gtol": 1e-7},
    )  # fmt: skip
    return np.exp(found.x)


def _minus_log_evidence(
    log_s: np.ndarray, at: Linearised, parameters: ParameterSet, postures: Postures
) -> tuple[float, np.ndarray]:
    """(log|C| + log|I| + r' C^-1 r + prior) / 2 at its best theta, up to a constant, and its gradient by log s."""
    D, scale, prior = np.exp(2.0 * log_s), parameters.scale, 1.0 / parameters.tolerance
    C = postures.covariance + (at.J_joint * D) @ np.swapaxes(at.J_joint, 1, 2)
    L = np.linalg.cholesky(C)
    W = np.linalg.inv(L)
    r, J, K = (W @ at.r[..., None])[..., 0], W @ at.J * scale, W @ at.J_joint
    flat, off = J.reshape(-1, len(scale)), prior * (at.theta - parameters.nominal)
    covariance, log_det = _inverse_and_log_det(flat.T @ flat + np.diag((prior * scale) ** 2))
    step = covariance @ (flat.T @ r.ravel() + prior * scale * off)
    r, off = r - J @ step, off - prior * scale * step
    KJ = np.swapaxes(K, 1, 2) @ J
    information = (K**2).sum(axis=(0, 1)) - ((KJ @ covariance) * KJ).sum(axis=(0, 2))
    gradient = D * (information - (np.einsum("nik,ni->nk", K, r) ** 2).sum(axis=0))
    log_det += 2.0 * float(np.log(np.diagonal(L, axis1=1, axis2=2)).sum())
    return 0.5 * (log_det + float((r**2).sum() + (off**2).sum())), gradient


def _covariance(J_white: np.ndarray, parameters: ParameterSet) -> np.ndarray:
    """(J'J + prior)^-1, inverted in scaled coordinates."""
    A, scale = J_white * parameters.scale, parameters.scale
    return _inverse_and_log_det(A.T @ A + np.diag((scale / parameters.tolerance) ** 2))[0] * scale * scale[:, None]


def _inverse_and_log_det(information: np.ndarray) -> tuple[np.ndarray, float]:
    """Inverse and log determinant of a symmetric matrix; directions without information get a huge variance."""
    values, vectors = np.linalg.eigh(information)
    values = np.maximum(values, 1e-15 * values[-1])
    return (vectors / values) @ vectors.T, float(np.log(values).sum())
