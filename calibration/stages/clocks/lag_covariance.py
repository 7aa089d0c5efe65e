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
from scipy.linalg import block_diag

from calibration.numerics.robust_covariance import long_run_covariance, widening
from calibration.numerics.time_delay import inverse_root

_BLOCK = 2.5  # [s] a move, or half a swing
_LEAST = 1e-3  # [-] share of a block's noise that is left in its residuals, at least


@dataclass(frozen=True)
class Reduced:
    """The problem without its nuisances: 6 n rows of n samples, then b rows of the coefficients with a prior.

    Attributes:
        r: (6 n + b,) whitened residuals without their part in U.
        S: (6 n + b, 2) their derivatives by lag and drift, likewise.
        V: (6 n + b, p + 2) basis of the span U, orthonormal but for rounding; and S with its part in U, normalised.
        M: (n_blocks + 1, p + 2, p + 2) V_g' V_g of each block of samples, then of the coefficients.
        t: (n,) [s, mocap clock].
    """

    r: np.ndarray
    S: np.ndarray
    V: np.ndarray
    M: np.ndarray
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
    """Eliminate columns A (6 n, a), free, and B (6 n, b), with coefficients N(0, 1), from r (6 n,) and S (6 n, 2).

    The basis of D = [A B; 0 1] is D (D'D)^-1/2, twice, as the square of D's condition is lost; the second time only the
    Gram matrices, block by block, are formed.

    Reference: Fukaya et al., SIAM J. Sci. Comput. 2020 (Cholesky QR twice).
    """
    a, b = A.shape[1], B.shape[1]
    y = np.concatenate([np.column_stack([r, S]), np.zeros((b, 3))])
    D = np.block([[A, B, S], [np.zeros((b, a)), np.eye(b), np.zeros((b, 2))]])
    square = D.T @ D
    V = D @ block_diag(inverse_root(square[:-2, :-2]), np.diag(np.diag(square)[-2:] ** -0.5))
    M = np.array([V[i:j].T @ V[i:j] for i, j in pairwise([*_starts(t), len(r), len(V)])])
    U, X = V[:, :-2], inverse_root(M.sum(axis=0)[:-2, :-2])
    y -= U @ (X @ (X.T @ (U.T @ y)))
    return Reduced(y[:, 0], y[:, 1:], V, M, t)


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
    """Residuals e (6 n + b,) times (1 - H_gg)^-1/2, block by block, H = V Z Z' V'."""
    m, Z = 6 * len(x.t), inverse_root(x.M.sum(axis=0))
    left = np.maximum(1.0 - ((x.V[m:] @ Z) ** 2).sum(axis=1), _LEAST)
    out = np.concatenate([e[:m], e[m:] / np.sqrt(left)])
    for (i, j), M in zip(pairwise([*_starts(x.t), m]), x.M[:-1], strict=True):
        taken, E = np.linalg.eigh(Z.T @ M @ Z)
        known = taken > 1e-9
        Y = Z @ (E[:, known] / np.sqrt(taken[known]))
        gain = 1.0 / np.sqrt(np.maximum(1.0 - taken[known], _LEAST)) - 1.0
        out[i:j] += x.V[i:j] @ (Y @ (gain * (Y.T @ (x.V[i:j].T @ e[i:j]))))
    return out
