"""Lag and drift of one trial where its nuisances are eliminated, and their covariance.

    r = S x + A a + B b + noise,   b ~ N(0, 1)         x = lag, drift; U spans the columns of A and B
    x = (S'S)^-1 S' r,             psi_g = (S'S)^-1 S_g' (1 - H_gg)^-1/2 e_g         e = r - S x

for r and S without their parts in U. A hundred nuisances follow a move's residuals as they follow its motion: within a
block g of some seconds, about a move, e_g is short of the noise by 1 - H_gg, H the projector onto U and S, and just so
in the directions that identify the clock. Dividing by its root gives the noise its size back; a count of degrees of
freedom alone, alike for all directions, leaves a drift from 20 moves a quarter short. Residuals stay alike for
`MEMORY`; the coefficients b, each a block of its own, are independent. A variance summed from few blocks is itself
uncertain: standard deviations are Student's, so that 1.96 of them hold 95 %,

    nu = (sum_g v_g)^2 / sum_g v_g^2,   v_g = |(S'S)^-1 S_g'|^2 of the block

Reference: Bell, McCaffrey, Survey Methodology 2002 (bias-reduced linearisation); Newey, West, Econometrica 1987.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from calibration.numerics.robust_covariance import long_run_covariance, widening

_BLOCK = 2.5  # [s] a move, or half a swing
_RANK = 1e-13  # least eigenvalue of a Gram matrix to its largest
_LEAST = 1e-3  # [-] share of a block's noise that is left in its residuals, at least


@dataclass(frozen=True)
class Reduced:
    """The problem without its nuisances: 6 n rows of n samples, then b rows of the coefficients with a prior.

    Attributes:
        r: (6 n + b,) whitened residuals without their part in U.
        S: (6 n + b, 2) their derivatives by lag and drift, likewise.
        U: (6 n + b, p) orthonormal basis of the nuisances.
        t: (n,) [s, mocap clock].
    """

    r: np.ndarray
    S: np.ndarray
    U: np.ndarray
    t: np.ndarray

    def coefficients(self, x: np.ndarray) -> np.ndarray:
        """b (b,) where x (2,) are lag and drift."""
        m = 6 * len(self.t)
        return self.S[m:] @ x - self.r[m:]

    def taken_for(self, r: np.ndarray) -> float:
        """Lag [s] that residuals r (6 n,) beside those there are would be taken for, were the drift known."""
        lag = self.S[:, 0]
        return float(lag[: len(r)] @ r / (lag @ lag))


def without_nuisances(A: np.ndarray, B: np.ndarray, r: np.ndarray, S: np.ndarray, t: np.ndarray) -> Reduced:
    """Eliminate columns A (6 n, a), free, and B (6 n, b), with coefficients N(0, 1), from r (6 n,) and S (6 n, 2)."""
    size, b = np.linalg.norm(A, axis=0), B.shape[1]
    A = A[:, size > 0.0]
    U = _orthonormal(np.block([[A, B], [np.zeros((b, A.shape[1])), np.eye(b)]]))
    y = np.concatenate([np.column_stack([r, S]), np.zeros((b, 1 + S.shape[1]))])
    y = y - U @ (U.T @ y)
    return Reduced(y[:, 0], y[:, 1:], U, t)


def _orthonormal(D: np.ndarray) -> np.ndarray:
    """Basis of the columns of a tall D, by the eigenvectors of D'D: twice, as the square of its condition is lost.

    Reference: Fukaya et al., SIAM J. Sci. Comput. 2020 (Cholesky QR twice).
    """
    U = D / np.linalg.norm(D, axis=0)
    for _ in range(2):
        square, V = np.linalg.eigh(U.T @ U)
        kept = square > _RANK * square[-1]
        U = U @ (V[:, kept] / np.sqrt(square[kept]))
    return U


def lag_and_drift(x: Reduced) -> tuple[np.ndarray, np.ndarray]:
    """Least squares for lag [s] and drift [-] (2,), and their covariance (2, 2), whose intervals are Student's."""
    m, dt = 6 * len(x.t), float(np.median(np.diff(x.t)))
    scale = np.linalg.norm(x.S, axis=0)
    G = x.S @ (np.linalg.inv(x.S.T @ x.S / np.outer(scale, scale)) / np.outer(scale, scale))
    found = G.T @ x.r
    e = _given_back(x, x.r - x.S @ found)
    psi = e[:, None] * G
    in_time, prior = psi[:m].reshape(-1, 6, 2).sum(axis=1), psi[m:]
    v = np.add.reduceat(G[:m] ** 2, _starts(x.t))
    wider = widening(v)
    return found, np.outer(wider, wider) * long_run_covariance(in_time, 1.0 / dt) + prior.T @ prior


def _starts(t: np.ndarray) -> np.ndarray:
    """First row of each block of samples at t (n,) [s]."""
    return 6 * np.flatnonzero(np.diff(np.floor((t - t[0]) / _BLOCK), prepend=-1.0))


def _given_back(x: Reduced, e: np.ndarray) -> np.ndarray:
    """Residuals e (6 n + b,) times (1 - H_gg)^-1/2, block by block."""
    m, V = 6 * len(x.t), np.column_stack([x.U, np.linalg.qr(x.S)[0]])
    left = np.maximum(1.0 - (V**2).sum(axis=1), _LEAST)
    out = e / np.sqrt(left)  # stays for the rows of the prior
    for a, b in pairwise([*_starts(x.t), m]):
        taken, E = np.linalg.eigh(V[a:b].T @ V[a:b])
        known = taken > 1e-9
        Y = V[a:b] @ (E[:, known] / np.sqrt(taken[known]))
        gain = 1.0 / np.sqrt(np.maximum(1.0 - taken[known], _LEAST)) - 1.0
        out[a:b] = e[a:b] + Y @ (gain * (Y.T @ e[a:b]))
    return out
