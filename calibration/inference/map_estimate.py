"""Maximum a posteriori fit of a hand model to static postures, its random errors and its priors' widths estimated too.

    r_i(theta) = log6(T_measured_i^-1 T_B_H(q_i, theta))                local twist of the hand [m, rad]
    minimise  sum_i w_i r_i' C_i^-1 r_i  +  sum_j ((theta_j - nominal_j) / tolerance_j)^2 / f_h(j)
    C_i = S_i + Jq_i diag(s^2) Jq_i' (+ position and rotation of the hand)

S_i is the measured pose's covariance, s_j the random error of joint j's reading (backlash, friction: what no constant
describes), carried to the hand by that posture's own lever arms. s and f maximise the marginal likelihood of the
data linearised at theta, theta integrated out (`marginal_likelihood`), on a spread subset where postures are many;
Gauss-Newton steps on all of them in between.
References: MacKay, Neural Computation 1992; Hollerbach, Khalil, Gautier, Springer Handbook of Robotics, ch. 6.
"""

import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import lapack

from calibration.inference.marginal_likelihood import Hyperparameters, inverse_and_log_det, maximised, moved_by
from calibration.inference.noise_selection import selected
from calibration.inference.parameters import ParameterSet, Prior
from calibration.inference.residual import Linearised, Noise, Residual, stacked, stacked_noise

_OUTER = 15
_DECREASE = 1e-3  # the last Gauss-Newton step promises a smaller decrease of the cost [-], the one after it 1e-7
_SAME = 1e-2  # outer iterations stop below this change of log s [-], a fraction of what 160 postures determine
_COARSE, _COARSE_DECREASE = 0.1, 1.0
_MANY = 960  # components the evidence is asked with: standard deviations to 4 %
_LEVERAGE = 20.0  # components per parameter above which a posture hardly moves its own prediction
_MIN_PIVOT = 1e-5  # smallest over largest pivot of the normal equations [-]
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Problem:
    """What is to be fitted: residuals stacked, and the priors of all parameters they depend on.

    Attributes:
        residuals: Each depends on some of the parameters, found by name; random errors of one name are one group.
        parameters: Priors.
        stated: The random errors are stated beforehand, by a datasheet: none is dropped, none is zero.
        start: Hyperparameters to begin with; those of `noise` and prior factors of 1 where not given.
    """

    residuals: tuple[Residual, ...]
    parameters: ParameterSet
    stated: bool = False
    start: Hyperparameters | None = None

    @cached_property
    def prior(self) -> Prior:
        """Of the parameters."""
        return self.parameters.prior

    @cached_property
    def noise(self) -> Noise:
        """Groups of random errors of all residuals."""
        if self._single:
            return self.residuals[0].noise
        return stacked_noise([r.noise for r in self.residuals], self.linearise(self.prior.nominal).r.shape[1])

    @property
    def widths(self) -> Hyperparameters:
        """Hyperparameters to begin with."""
        return self.start or Hyperparameters(self.noise.start, np.ones(self.prior.n_groups))

    def linearise(self, theta: np.ndarray) -> Linearised:
        """Residuals and derivatives at theta (p,)."""
        if self._single:
            return self.residuals[0].linearise(theta)
        columns = [np.array([self.parameters.names.index(name) for name in r.names]) for r in self.residuals]
        parts = [r.linearise(theta[mine]) for r, mine in zip(self.residuals, columns, strict=True)]
        return stacked(parts, columns, theta)

    @property
    def _single(self) -> bool:
        return len(self.residuals) == 1 and self.residuals[0].names == self.parameters.names


@dataclass(frozen=True)
class Fit:
    """Result of a fit.

    Attributes:
        at: The problem at the solution.
        noise: Groups of random errors.
        widths: Sizes of the random errors and factors on the priors.
        covariance: (p, p) of theta.
        whitener: (n, d, d) W with W' W = C^-1.
        converged: Whether both theta and the widths stood still.
    """

    at: Linearised
    noise: Noise
    widths: Hyperparameters
    covariance: np.ndarray
    whitener: np.ndarray
    converged: bool

    @property
    def theta(self) -> np.ndarray:
        """Estimated parameters (p,)."""
        return self.at.theta

    def noise_sigma(self, names: Iterable[str]) -> np.ndarray:
        """Standard deviations of random errors by name, those there are none of left out [rad, m]."""
        return np.array([self.widths.noise[self.noise.names.index(n)] for n in names if n in self.noise.names])

    @property
    def J_white(self) -> np.ndarray:
        """Whitened Jacobian (d n, p)."""
        return self.rows_white(np.arange(len(self.at.r)))

    def rows_white(self, chosen: np.ndarray) -> np.ndarray:
        """That of some postures."""
        return (self.whitener[chosen] @ self.at.J[chosen]).reshape(-1, len(self.theta))

    @property
    def r_white(self) -> np.ndarray:
        """Whitened residuals (n, d) [-]."""
        return (self.whitener @ self.at.r[..., None])[..., 0]


@dataclass(frozen=True)
class _Step:
    """A Gauss-Newton step: change of theta (p,), expected decrease of the cost, covariance (p, p), the cost before."""

    change: np.ndarray
    predicted_decrease: float
    covariance: np.ndarray
    cost: float


def solve(
    problem: Problem, at: Linearised, weigh: Callable[[np.ndarray], np.ndarray] | None = None, coarse: bool = False
) -> Fit:
    """Alternate marginal likelihood and Gauss-Newton until both converge.

    Args:
        problem: What is to be fitted.
        at: The problem where to start.
        weigh: Weights (n,) from squared distances (n,) as `distances` gives them; one where there is none.
        coarse: Be content with widths to a tenth and theta to a sigma, as a start for all postures.
    """
    same, predicted_decrease = (_COARSE, _COARSE_DECREASE) if coarse else (_SAME, _DECREASE)
    widths, noise, at = problem.widths, problem.noise, replace(at, weight=np.ones(len(at.r)))
    some = spread(len(at.r), at.r.shape[1], _MANY)
    change, free = np.inf, None
    for _ in range(_OUTER):
        settled = change < same
        old = widths
        if not settled and (coarse or problem.stated):
            widths, _ = maximised(at.rows(some), noise, problem.prior, widths, same, present=problem.stated)
        elif not settled:
            free, widths = selected(at.rows(some), noise, problem.prior, widths, free, same)
        W = noise.whitener(at, widths.noise)
        step = _step(problem.prior, at, W, widths)
        if not settled:
            change = max(moved_by(old.noise, widths.noise, 10.0 * noise.floor), moved_by(old.prior, widths.prior, 0.0))
        if weigh is not None and not settled:
            weight = weigh(distances(at.moved(step.change), noise, widths, step.covariance))
            change = max(change, float(np.abs(weight - at.weight).max()))
            at = replace(at, weight=weight)
        still = step.predicted_decrease < predicted_decrease
        if still and change < same:
            return Fit(at.moved(step.change), noise, widths, step.covariance, W, True)
        lower = at if still else _descended(problem, at, W, widths, step)
        if lower is None:
            break
        at = replace(lower, weight=at.weight)
    return Fit(at, noise, widths, step.covariance, W, False)


def spread(n: int, d: int, components: int) -> np.ndarray:
    """Evenly spread ones of n postures with d components each, together about as many as asked for."""
    return np.unique(np.linspace(0, n - 1, components // d).astype(int))


def distances(at: Linearised, noise: Noise, widths: Hyperparameters, covariance: np.ndarray) -> np.ndarray:
    """Squared Mahalanobis distance (n,) of each posture from what all others predict [-].

    r' (I - w M)^-1 (I - w M + M)^-1 r,     M = W J covariance J' W'
    """
    root, (n, d, p) = noise.roots(at.B, widths.noise), at.J.shape
    r = (root @ at.r[..., None])[..., 0]
    if n * d > _LEVERAGE * p:
        return (r**2).sum(axis=1)
    A = root @ at.J
    M, eye = A @ covariance @ np.swapaxes(A, 1, 2), np.eye(d)
    left = eye - at.weight[:, None, None] * M
    # Rounding may leave a posture that is nowhere else in the data a negative share.
    inner = np.linalg.solve(left, np.linalg.solve(left + M, r[..., None]))[..., 0]
    return np.abs((r * inner).sum(axis=1))


def _step(prior: Prior, at: Linearised, W: np.ndarray, widths: Hyperparameters) -> _Step:
    """From the normal equations; by orthogonal factors where data and priors differ too much for those."""
    scale, (n, d, p) = prior.scale, at.J.shape
    A, r = (W @ at.J).reshape(n * d, p), (W @ at.r[..., None]).ravel()
    root = np.sqrt(prior.precision(widths.prior)) * scale
    off = root * (at.theta - prior.nominal) / scale
    cost = float(r @ r + off @ off)
    information = (A.T @ A) * scale * scale[:, None] + np.diag(root**2)
    factor, failed = lapack.dpotrf(information, lower=True)
    diagonal = np.diagonal(factor)
    if failed or diagonal.min() < _MIN_PIVOT * diagonal.max():
        stacked = np.vstack([A * scale, np.diag(root)])
        change = -np.linalg.lstsq(stacked, np.concatenate([r, off]), rcond=None)[0]
        predicted_decrease, covariance = float(((stacked @ change) ** 2).sum()), inverse_and_log_det(information)[0]
    else:
        gradient = scale * (A.T @ r) + root * off
        change = -lapack.dpotrs(factor, gradient, lower=True)[0]
        predicted_decrease, covariance = float(-gradient @ change), inverse_and_log_det(information)[0]
    return _Step(scale * change, predicted_decrease, covariance * scale * scale[:, None], cost)


def _descended(
    problem: Problem, at: Linearised, W: np.ndarray, widths: Hyperparameters, step: _Step
) -> Linearised | None:
    """The problem after a step, halved until the cost at fixed weights does not rise; None where it always does."""
    prior, precision = problem.prior, problem.prior.precision(widths.prior)
    for halved in range(12):
        trial = problem.linearise(at.theta + 0.5**halved * step.change)
        cost = float(((W @ trial.r[..., None]) ** 2).sum() + (precision * (trial.theta - prior.nominal) ** 2).sum())
        if cost <= step.cost * (1.0 + 1e-12):
            return trial
    return None
