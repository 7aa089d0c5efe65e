"""Covariance of a fit whose model leaves something out, as far as its residuals show it.

    y = J (theta - theta_hat) + N nu + noise          whitened;  nu_j ~ N(0, s_g(j)^2) in what the model leaves out
    covariance = H^-1 + K N diag(s^2) N' K',          H = J'J + P,  K = H^-1 J',  P information of the prior

N are directions in which robots depart from the model, in groups of one size s_g each: a group's visible directions
decide its size, and those that the parameters absorb, which no residual shows, have it too. Sizes maximise the evidence
of the residuals r = y - J (...), theta integrated out,

    ln p = -1/2 ln|1 + D^1/2 G D^1/2| + 1/2 b'(G + D^-1)^-1 b,     b = N'r,  G = N'(1 - J K) N,  D = diag(s^2)

by Fisher scoring. Where that hardly exceeds the evidence of no departure, there is none. Else each size in
the covariance is not the best one, which is 0 as soon as a group is hardly visible, but averaged over the evidence,

    s_g^2 = int s^2 p(s) e^(-s / a) ds / int p(s) e^(-s / a) ds           the other groups at their best

a the size expected beforehand: what a model leaves out is as large as the random errors it had to allow its readings
(exponential: of all sizes with that mean the one that states nothing else).

A group is called seen where the evidence without it, all others at their best, is lower by `PRICE`.
Reference: Kennedy, O'Hagan, JRSS B 2001.
"""

from dataclasses import dataclass

import numpy as np

from calibration.inference.map_estimate import Fit
from calibration.inference.parameters import ParameterSet

PRICE = 4.0
_CONSISTENT = 2.0  # evidence of all departures together below which residuals are those of the model
_ROUNDS = 40
_SAME = 1e-3  # relative change of a variance
_SIZES = np.geomspace(1e-6, 3e-2, 24)  # [rad, m]


@dataclass(frozen=True)
class Departures:
    """Directions in which robots depart from a model, at n rows of d components.

    Attributes:
        N: (n, d, m) [as the residuals] by unit size.
        group: (m,) number of each one's group.
        names: Of the groups.
        expected: a, size expected beforehand.
    """

    N: np.ndarray
    group: np.ndarray
    names: tuple[str, ...]
    expected: float


@dataclass(frozen=True)
class Misfit:
    """What residuals show of a model's departures.

    Attributes:
        names: Of the groups.
        size: (g,) standard deviations.
        evidence: (g,) what each group adds to the logarithm of the evidence.
        covariance: (p, p) of the parameters, the departures counted.
    """

    names: tuple[str, ...]
    size: np.ndarray
    evidence: np.ndarray
    covariance: np.ndarray

    @property
    def seen(self) -> tuple[tuple[str, float], ...]:
        """Groups that are seen and their sizes, the clearest first."""
        order = np.argsort(-self.evidence)
        return tuple((self.names[g], float(self.size[g])) for g in order if self.evidence[g] >= PRICE)


def misfit(fit: Fit, parameters: ParameterSet, departures: Departures) -> Misfit:
    """What the residuals of a fit show of departures from its model."""
    J, r = fit.J_white, fit.r_white.ravel()
    N = (fit.whitener @ departures.N).reshape(len(r), -1)
    H = J.T @ J + np.diag(parameters.prior.precision(fit.widths.prior))
    moved = np.linalg.solve(H, J.T @ N)
    problem = _Evidence(N.T @ N - (N.T @ J) @ moved, N.T @ r, departures.group, len(departures.names))
    free = np.ones(problem.groups, dtype=bool)
    variance = problem.maximised(free)
    best, gain = problem.value(variance), np.zeros(problem.groups)
    if best < _CONSISTENT:
        return Misfit(departures.names, np.zeros(problem.groups), gain, fit.covariance)
    for g in np.flatnonzero(variance):
        off = np.where(np.arange(problem.groups) == g, 0.0, variance)
        gain[g] = best - problem.value(off)
        if gain[g] >= PRICE:
            gain[g] = best - problem.value(problem.maximised(off > 0.0, off))
    size = np.sqrt([problem.averaged(variance, g, departures.expected) for g in range(problem.groups)])
    spread = moved * size[departures.group]
    return Misfit(departures.names, size, gain, fit.covariance + spread @ spread.T)


@dataclass(frozen=True)
class _Evidence:
    """Evidence of the residuals by the groups' variances (g,).

    Attributes:
        G: (m, m).
        b: (m,).
        group: (m,).
        groups: Their number.
    """

    G: np.ndarray
    b: np.ndarray
    group: np.ndarray
    groups: int

    def value(self, variance: np.ndarray) -> float:
        """ln p; none where the variances are so large that rounding leaves it no value."""
        root = np.sqrt(variance[self.group])
        inner = np.eye(len(root)) + root[:, None] * self.G * root
        try:
            L, c = np.linalg.cholesky(inner), root * self.b
        except np.linalg.LinAlgError:
            return -np.inf
        return float(0.5 * np.square(np.linalg.solve(L, c)).sum() - np.log(L.diagonal()).sum())

    def maximised(self, free: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
        """(g,) variances of highest evidence, from `start` where given, those that are not `free` zero."""
        visible = np.array([np.trace(self.G[np.ix_(k, k)]) for k in self._members])
        small = np.where(visible > 0.0, 1.0 / np.maximum(visible, np.finfo(float).tiny), 0.0)
        variance = np.where(free, small if start is None else start, 0.0)
        value = self.value(variance)
        for _ in range(_ROUNDS):
            score, fisher = self._slope(variance)
            step = np.zeros(self.groups)
            active = free & ((variance > 0.0) | (score > 0.0)) & (visible > 0.0)
            if not active.any():
                break
            step[active] = np.linalg.lstsq(fisher[np.ix_(active, active)], score[active], rcond=1e-12)[0]
            trial, rose = variance, -np.inf
            for halved in range(12):
                trial = np.maximum(variance + 0.5**halved * step, 0.0)
                rose = self.value(trial)
                if rose >= value:
                    break
            if rose < value:
                break
            still = np.abs(trial - variance).max() <= _SAME * trial.max(initial=0.0)
            variance, value = trial, rose
            if still:
                break
        return variance

    def averaged(self, variance: np.ndarray, g: int, expected: float) -> float:
        """Square of the size of group g, averaged over evidence and expectation, the others' variances (g,) given."""
        others = np.arange(self.groups) != g
        trials = [np.where(others, variance, size**2) for size in _SIZES]
        value = np.array([self.value(trial) for trial in trials])
        weight = np.exp(value - value.max() - _SIZES / expected) * _SIZES  # ds of evenly spread logarithms
        return float(weight @ _SIZES**2 / weight.sum())

    def _slope(self, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives (g,) by the variances, and the expected curvature (g, g)."""
        inner = np.eye(len(self.b)) + self.G * variance[self.group]
        A, a = np.linalg.solve(inner, self.G), np.linalg.solve(inner, self.b)
        score = np.array([0.5 * ((a[k] ** 2).sum() - np.trace(A[np.ix_(k, k)])) for k in self._members])
        fisher = np.array([[0.5 * (A[np.ix_(k, j)] ** 2).sum() for j in self._members] for k in self._members])
        return score, fisher

    @property
    def _members(self) -> list[np.ndarray]:
        return [np.flatnonzero(self.group == g) for g in range(self.groups)]
