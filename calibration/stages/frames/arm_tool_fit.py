"""Arm base and tool on SE(3): Heins's equations 5 and 6, weighted.

    T_lab_t = T_lab_base  T_base_arm  T_arm_e(q)  T_e_t
    minimise over T_base_arm, T_e_t    sum_i  r_i' S_i^-1 r_i,      r_i = log6(M_i^-1  X A_i Y)        [m, rad]

with X = T_nominal^-1 T_base_arm the increment on a nominal guess (his footnote; any guess, the identity too),
Y = T_e_t, A_i = T_arm_e(q_i) of the factory's arm, M_i = (T_lab_base T_nominal)^-1 T_lab_t as measured, S_i the
covariance of its local twist. The text prints T_wt under the argmin; T_e_t is what is varied. Both are kept on
the manifold, X <- X exp6(x), Y <- Y exp6(y), with

    dr_i = J_log6(r_i) (Ad((A_i Y)^-1) dx + dy)

The start needs no guess: relative motions M_i M_j^-1 = X (A_i A_j^-1) X^-1 give the rotation of X by aligning their
axes, then all translations are linear. Twelve directions are fixed once the arm turns about two axes.
A robust fit takes r_i as Student's t: weights (nu + 6) / (nu + d_i^2), d_i^2 the scaled Mahalanobis distance.
References: Heins 2022; Park, Martin, IEEE TRA 1994 (the start); Lange, Little, Taylor, JASA 1989 (the weights).
"""

from dataclasses import dataclass

import numpy as np

from calibration.numerics.alignment import start
from calibration.numerics.lie import adjoint, exp6, inverse, jlog6, log6

_STEPS = 100
_REST = 1e-12  # [m, rad]
_NU = 4.0  # degrees of freedom of Student's t


@dataclass(frozen=True)
class ArmTool:
    """Arm base and tool.

    Attributes:
        X: (4, 4) increment of the arm's base on the nominal one.
        Y: (4, 4) T_e_t.
        covariance: (12, 12) of the local twists x, y, for S_i as given [m, rad].
        distance: (n,) squared Mahalanobis distance of each posture, expectation near 6 [-].
        weight: (n,) of each posture, 1 unless robust.
        converged: Whether the iteration came to rest.
    """

    X: np.ndarray
    Y: np.ndarray
    covariance: np.ndarray
    distance: np.ndarray
    weight: np.ndarray
    converged: bool

    @property
    def chi2(self) -> float:
        """Weighted squared residual per degree of freedom [-]."""
        return float(self.weight @ self.distance) / max(1, 6 * len(self.distance) - 12)


def fit_arm_tool(M: np.ndarray, A: np.ndarray, covariance: np.ndarray, robust: bool = False) -> ArmTool:
    """Fit X and Y to M_i = X A_i Y.

    Args:
        M: (n, 4, 4) measured.
        A: (n, 4, 4) of the arm.
        covariance: (n, 6, 6) of the local twists of M [m, rad].
        robust: Student's t instead of a normal distribution.

    Raises:
        NotEnoughData: The arm turns about one axis only.
    """
    X, Y = start(M, A)
    W = np.linalg.inv(np.linalg.cholesky(covariance))
    weight, converged = np.ones(len(M)), False
    for _ in range(_STEPS):
        r, J = residuals(X, Y, M, A)
        r, J = (W @ r[..., None])[..., 0], W @ J
        distance = (r**2).sum(axis=1)
        if robust:
            weight = _weights(distance)
        normal = np.einsum("n,nij,nik->jk", weight, J, J)
        step = -np.linalg.solve(normal, np.einsum("n,nij,ni->j", weight, J, r))
        X, Y = X @ exp6(step[:6]), Y @ exp6(step[6:])
        if np.abs(step).max() < _REST:
            converged = True
            break
    return ArmTool(X, Y, np.linalg.inv(normal), distance, weight, converged)


def residuals(X: np.ndarray, Y: np.ndarray, M: np.ndarray, A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """r (n, 6) and its derivative (n, 6, 12) by local twists of X and Y."""
    AY = A @ Y
    r = log6(inverse(M) @ X @ AY)
    J_log = jlog6(r)
    return r, np.concatenate([J_log @ adjoint(inverse(AY)), J_log], axis=2)


def _weights(distance: np.ndarray) -> np.ndarray:
    """Student's t weights at the scale that belongs to them."""
    scale = float(np.median(distance)) / 6.0
    weight = np.ones(len(distance))
    for _ in range(50):
        weight = (_NU + 6.0) / (_NU + distance / max(scale, np.finfo(float).tiny))
        scale = float((weight * distance).mean()) / 6.0
    return weight
