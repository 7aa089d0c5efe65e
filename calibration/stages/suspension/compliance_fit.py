"""The reduced form: one symmetric 6x6 compliance S = K^-1 with damping C, fitted as it is used, wrench -> displacement.

    min sum |(x - x(w; S, C)) / sigma|^2,      x(w) the exact response of  (K + G) x + C dx/dt + M d2x/dt2 = w
    d x = (K + G + C s + M s^2)^-1 (K dS f - dC dx/dt),    f = K x the springs' force

Gauss-Newton with Levenberg's damping; sigma (6,) from the residual of the round before, so that an axis that slips
counts little. S and C stay positive definite: eigenvalues, in units of their diagonals at the start, are kept above
1e-4 of the largest. Only elements that the wheels can couple are fitted: contact points in the floor leave (x, y, rz)
and (z, rx, ry) apart, 12 elements; hub centres couple all 21. Constants of a trial are left out: its reference is one
second of markers. Variances count blocks of motion that are independent (`block_covariance`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.numerics.robust_covariance import block_covariance
from calibration.numerics.side_by_side import side_by_side
from calibration.numerics.signals import RATE
from calibration.stages.suspension.base_response import BaseResponse
from calibration.stages.suspension.modal_response import modes_of

_STRIDE = 4  # every so many samples of a residual that is low-passed at 10 Hz
_ROUNDS, _STEPS = 3, 12
_DONE = 1e-5  # relative gain that ends a round [-]
_FLOOR = 1e-4  # smallest eigenvalue over the largest, scaled [-]
_SETTLING = 0.015  # [s] time constant of the start
_DAMPING_PRIOR = 1.0  # standard deviation of C's elements, of the diagonals at the start [-]
UPPER = tuple((i, j) for i in range(6) for j in range(i, 6))


@dataclass(frozen=True)
class Share:
    """A trial's share: normal matrix (p, p), gradient (p,), whitened derivatives (m, 6, p) and residuals (m, 6)."""

    H: np.ndarray
    g: np.ndarray
    J: np.ndarray
    r: np.ndarray

    @property
    def squares(self) -> np.ndarray:
        """Sum of squared residuals of each axis (6,)."""
        return np.asarray((self.r**2).sum(axis=0))


@dataclass(frozen=True)
class Compliance:
    """A fit.

    Attributes:
        S: (6, 6) compliance [m/N, ...].
        C: (6, 6) damping [N.s/m, ...].
        dS: (p, 6, 6) directions of S; zero for the parameters of C.
        dC: (p, 6, 6) directions of C.
        shares: Of each trial.
        prior: (p, p) of the normal matrix.
    """

    S: np.ndarray
    C: np.ndarray
    dS: np.ndarray
    dC: np.ndarray
    shares: tuple[Share, ...]
    prior: np.ndarray

    @property
    def K(self) -> np.ndarray:
        """(6, 6) stiffness."""
        return _symmetric(np.linalg.inv(self.S))

    def moved(self, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """S and C after a step (p,)."""
        S = self.S + np.tensordot(step, self.dS, axes=1)
        C = self.C + np.tensordot(step, self.dC, axes=1)
        return _positive(S, np.sqrt(np.diag(self.S))), _positive(C, np.sqrt(np.diag(self.C)))

    def without(self, trial: int) -> tuple[np.ndarray, np.ndarray]:
        """K and C the other trials would have given, to first order."""
        H, g = self.prior.copy(), np.zeros(len(self.prior))
        for k, share in enumerate(self.shares):
            if k != trial:
                H, g = H + share.H, g + share.g
        S, C = self.moved(np.linalg.solve(H, g))
        return _symmetric(np.linalg.inv(S)), C

    def sigmas(self) -> tuple[np.ndarray, np.ndarray]:
        """Standard deviations (6, 6) of K and of C."""
        J, r = zip(*((share.J, share.r) for share in self.shares), strict=True)
        covariance, K = block_covariance(J, r, np.diag(self.prior)).covariance, self.K
        gains = [np.array([-K @ d @ K for d in self.dS]), self.dC]
        found = []
        for gain in gains:
            rows = np.array([gain[:, i, j] for i, j in UPPER])
            variance = ((rows @ covariance) * rows).sum(axis=1)
            sigma = np.zeros((6, 6))
            for (i, j), v in zip(UPPER, variance, strict=True):
                sigma[i, j] = sigma[j, i] = np.sqrt(max(v, 0.0))
            found.append(sigma)
        return found[0], found[1]


def fit_compliance(responses: Sequence[BaseResponse], couples: np.ndarray) -> Compliance:
    """Fit S and C; `couples` (6, 6) says which elements may differ from zero."""
    S, C = _start(responses)
    qS, qC = np.sqrt(np.diag(S)), np.sqrt(np.diag(C))
    elements = np.array([_element(i, j) for i, j in UPPER if couples[i, j]])
    none = np.zeros_like(elements)
    dS = np.concatenate([elements * np.outer(qS, qS), none])
    dC = np.concatenate([none, elements * np.outer(qC, qC)])
    prior = np.diag([0.0] * len(elements) + [_DAMPING_PRIOR**-2] * len(elements))
    sigma = np.sqrt(np.mean([(s.x**2).mean(axis=0) for s in responses], axis=0))
    for _ in range(_ROUNDS):
        S, C, shares = _round(responses, (S, C), (dS, dC), prior, sigma)
        squares, count = sum(s.squares for s in shares), sum(len(s.r) for s in shares)
        sigma = sigma * np.sqrt(np.maximum(squares / count, 1e-12))
    return Compliance(S, C, dS, dC, tuple(shares), prior)


def _round(
    responses: Sequence[BaseResponse],
    start: tuple[np.ndarray, np.ndarray],
    directions: tuple[np.ndarray, np.ndarray],
    prior: np.ndarray,
    sigma: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, list[Share]]:
    """Gauss-Newton steps with given weights."""
    dS, dC = directions
    qS, qC = (np.sqrt(np.diag(A)) for A in start)
    (S, C), lam = start, 1e-4
    shares = side_by_side(lambda s: _share(s, start, directions, sigma), responses)
    cost = sum(float(s.squares.sum()) for s in shares)
    for _ in range(_STEPS):
        H, g = sum((s.H for s in shares), prior), sum(s.g for s in shares)
        step = np.linalg.solve(H + lam * np.diag(np.diag(H)), g)
        S_new = _positive(S + np.tensordot(step, dS, axes=1), qS)
        C_new = _positive(C + np.tensordot(step, dC, axes=1), qC)
        tried = side_by_side(lambda s, at=(S_new, C_new): _share(s, at, directions, sigma), responses)
        new = sum(float(s.squares.sum()) for s in tried)
        if new < cost:
            gain, S, C, shares, cost, lam = cost - new, S_new, C_new, tried, new, max(lam / 10.0, 1e-9)
            if gain < _DONE * cost:
                break
        elif lam > 1e4:
            break
        else:
            lam *= 100.0
    return S, C, shares


def _share(
    response: BaseResponse,
    at: tuple[np.ndarray, np.ndarray],
    directions: tuple[np.ndarray, np.ndarray],
    sigma: np.ndarray,
) -> Share:
    """Residual and derivatives of one trial."""
    (S, C), (dS, dC) = at, directions
    f, K, step = response.forcing, np.linalg.inv(S), 1.0 / RATE
    modes = modes_of(K + f.tangent, C, f.inertia)
    x = modes.respond(f.w, step)
    rate = np.gradient(x, step, axis=0)
    rows = np.flatnonzero(response.valid)[::_STRIDE]
    parts = []
    for signal, b, d in ((x @ K.T, modes.b @ K, dS), (rate, -modes.b, dC)):
        gain = np.einsum("om,pmj->jmop", modes.a, b @ d[d.any(axis=(1, 2))])
        real = np.stack([gain.real, -gain.imag], axis=2).reshape(-1, 6 * gain.shape[3])  # as complex numbers are stored
        lagged = modes.lagged(signal, step, rows).reshape(len(rows), -1).view(float)
        parts.append((lagged @ real).reshape(len(rows), 6, -1))
    J = np.concatenate(parts, axis=2)
    r = (response.x - x)[rows]
    r, J = (r - r.mean(axis=0)) / sigma, (J - J.mean(axis=0)) / sigma[:, None]
    A = J.reshape(-1, J.shape[2])
    return Share(A.T @ A, A.T @ r.ravel(), J, r)


def _start(responses: Sequence[BaseResponse]) -> tuple[np.ndarray, np.ndarray]:
    """Diagonal compliance by each axis alone, and the damping of a base that settles in 15 ms."""
    xw = sum((s.x * s.forcing.w).sum(axis=0) for s in responses)
    ww, xx = sum((s.forcing.w**2).sum(axis=0) for s in responses), sum((s.x**2).sum(axis=0) for s in responses)
    ww = np.maximum(ww, np.finfo(float).tiny)
    compliance = np.maximum(np.abs(xw) / ww, 0.02 * np.sqrt(xx / ww))
    return np.diag(compliance), np.diag(_SETTLING / compliance)


def _element(i: int, j: int) -> np.ndarray:
    e = np.zeros((6, 6))
    e[i, j] = e[j, i] = 1.0
    return e


def _positive(A: np.ndarray, scale: np.ndarray) -> np.ndarray:
    values, vectors = np.linalg.eigh(A / np.outer(scale, scale))
    values = np.maximum(values, _FLOOR * values[-1])
    return _symmetric((vectors * values) @ vectors.T * np.outer(scale, scale))


def _symmetric(A: np.ndarray) -> np.ndarray:
    return 0.5 * (A + A.T)
