"""Fit of one joint model by variable projection: linear in A and B, a search in one variable for rho.

    M(rho) = [S Phi, (1 - S) Phi]        x(rho) = argmin |y - M x|^2        minimise |r(rho)|^2,  r = y - M x
    dr/drho = -M' x - M (M^T M)^-1 (M'^T r - M^T M' x)                      M' = dM/drho,  dS/drho = dq S (1 - S)

rho is sought in its logarithm, between limits: below them a flank is never chosen at the joint's speed, above them an
encoder's quantum chooses it.
References: Golub, Pereyra, SIAM J. Numer. Anal. 1973; Kaufman, BIT 1975.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg.lapack import dtrtrs
from scipy.optimize import brentq
from scipy.special import expit

Limit = Literal["lowest", "highest"]
RHO = (2.0, 1000.0)  # [s/rad] limits of the search
_GRID = 8
RANK = 1e-7  # smallest over largest singular value of the scaled design [-]
_CLEAR = 1e3 * RANK  # least over largest of R's diagonal, above which columns are clearly of full rank [-]


@dataclass(frozen=True)
class Problem:
    """Samples of one joint.

    Attributes:
        phi: (n, k) monomials.
        velocity: (n,) [rad/s].
        y: (n,) discrepancy [rad].
    """

    phi: np.ndarray
    velocity: np.ndarray
    y: np.ndarray

    def design(self, rho: float) -> np.ndarray:
        """M (n, 2 k)."""
        S = expit(rho * self.velocity)[:, None]
        return np.hstack([S * self.phi, (1.0 - S) * self.phi])

    def design_slope(self, rho: float) -> np.ndarray:
        """dM/drho (n, 2 k)."""
        S = expit(rho * self.velocity)
        change = (self.velocity * S * (1.0 - S))[:, None] * self.phi
        return np.hstack([change, -change])


@dataclass(frozen=True)
class Projection:
    """The problem solved for the coefficients at one rho.

    Attributes:
        rho: [s/rad].
        x: (2 k,) coefficients a, b of the scaled monomials [rad].
        r: (n,) residuals [rad].
        slope: (n,) their derivative by rho, x following.
        full_rank: Whether the samples fix every coefficient.
    """

    rho: float
    x: np.ndarray
    r: np.ndarray
    slope: np.ndarray
    full_rank: bool


def project(problem: Problem, rho: float) -> Projection:
    """Best coefficients at rho and the residuals' derivative; of undetermined ones the smallest."""
    M, dM = problem.design(rho), problem.design_slope(rho)
    U, s, Vt = np.linalg.svd(M, full_matrices=False)
    kept = s > RANK * s[0]
    U, s, Vt = U[:, kept], s[kept], Vt[kept]
    x = Vt.T @ ((U.T @ problem.y) / s)
    r = problem.y - M @ x
    moved = dM @ x
    slope = -moved - U @ ((Vt @ (dM.T @ r)) / s - U.T @ moved)
    return Projection(rho, x, r, slope, bool(kept.all()))


def search(problem: Problem) -> Projection:
    """The best rho within its limits: best of a grid, then the zero of the derivative next to it."""
    grid = rho_grid()
    columns = range(2 * problem.phi.shape[1])
    best = best_of_grid(triangular(problem, columns, grid), len(columns))[0]
    low, high = np.log(grid[max(best - 1, 0)]), np.log(grid[min(best + 1, len(grid) - 1)])

    def slope(log_rho: float) -> float:
        found = project(problem, float(np.exp(log_rho)))
        return float(found.slope @ found.r)

    if slope(low) >= 0.0:
        return project(problem, float(np.exp(low)))
    if slope(high) <= 0.0:
        return project(problem, float(np.exp(high)))
    return project(problem, float(np.exp(brentq(slope, low, high, xtol=1e-10))))


def triangular(problem: Problem, columns: Sequence[int], rhos: np.ndarray) -> np.ndarray:
    """R of the QR of [M, y] at every rho, (n_rhos, c + 1, c + 1), of c columns of M in their order."""
    n, c = len(problem.y), len(columns)
    rows = np.zeros((len(rhos), max(n, c + 1), c + 1))
    for of_rho, rho in zip(rows, rhos, strict=True):
        of_rho[:n, :c], of_rho[:n, c] = problem.design(rho)[:, columns], problem.y
    return np.asarray(np.linalg.qr(rows, mode="r"))


def best_of_grid(factors: np.ndarray, p: int) -> tuple[int, np.ndarray]:
    """Which rho leaves the least |y - M x|^2, and x, of the first p columns M of triangular [M, ..., y] at every rho.

    What columns of full rank would leave is the least that can be left: most rho need no solution.
    """
    least = (factors[:, p:, -1] ** 2).sum(axis=1)
    best, found = np.inf, (0, np.zeros(p))
    for k in np.argsort(least):
        if least[k] >= best:
            break
        R, y = factors[k, :p, :p], factors[k, :p, -1]
        x = _solution(R, y)
        left = float(least[k] + ((y - R @ x) ** 2).sum())
        best, found = (left, (int(k), x)) if left < best else (best, found)
    return found


def _solution(R: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The least x of R x = y in least squares, R triangular."""
    size = np.abs(R.diagonal())
    if size.min() > _CLEAR * size.max():
        return np.asarray(dtrtrs(R, y)[0])
    return np.asarray(np.linalg.lstsq(R, y, rcond=RANK)[0])


def rho_grid() -> np.ndarray:
    """Values at which the search is started."""
    return np.geomspace(*RHO, _GRID)


def limit_of(rho: float) -> Limit | None:
    """The limit at which the search for rho ended, None where the data found it inside.

    At the lowest a joint's speeds hardly choose a flank: rho (A - B) and A + B are identified, A, B and rho are not. At
    the highest the flanks change between two readings: A and B are identified, rho is not.
    """
    return "lowest" if rho < 1.01 * RHO[0] else "highest" if rho > 0.99 * RHO[1] else None
