"""What a force plate says of a base's parameters while it moves: an ensemble Kalman filter of all it has measured.

    x = mean_e x_e - X (1 + A)^-1 b,    var x = (1 - LEFT) X (1 + A)^-1 X' + LEFT X X'
    A = 2 TRUST int sum_a q_a R_a' R_a dt,    b = 2 TRUST int sum_a q_a R_a' r_a dt,    q_a = 1 / (1 + r_a^2)

Columns of X (3, n) are (x_e - mean x) / n^1/2, r_e = (F - sum_i A_i' f_i) / (2 sigma) of n members, r their mean and R
as X. The force of wheels that slide is their friction, in which members differ, and so does how far they slide. q
weighs a force as the loss of `preloaded` does. Members that no plate judges, or that bear alike, are as far apart as
they were. Weights instead, as of preloads, leave of so few members one; members that differ in all parameters by what
the model may miss follow that, too.
Reference: Evensen, Ocean Dynamics 53, 2003.
"""

import numpy as np

from calibration.numerics.compiled import njit
from calibration.stages.stick_slip.kernel.preloaded import LEFT, TRUST


@njit(cache=True, error_model="numpy")
def learn(learnt: np.ndarray, missed: np.ndarray, dt: float) -> None:
    """Add a sample of dt [s] to A's lower half and b, (n, n + 1), by r_e (n, 3)."""
    n = len(missed)
    for a in range(3):
        mean = missed[:, a].mean()
        weight = 2.0 * TRUST * dt / (1.0 + mean * mean) / n
        for i in range(n):
            own = weight * (missed[i, a] - mean)
            learnt[i, n] += own * mean * np.sqrt(n)
            for j in range(i + 1):
                learnt[i, j] += own * (missed[j, a] - mean)


@njit(cache=True, error_model="numpy")
def informed(learnt: np.ndarray, x: np.ndarray, out: np.ndarray) -> None:
    """Mean of members x (n, 3) and its variance, (2, 3), by A and b (n, n + 1); by Cholesky's factor of 1 + A."""
    n = len(x)
    L, y = np.empty((n, n)), np.empty((n, 4))  # y: of b, then of X'
    for a in range(3):
        out[0, a] = x[:, a].mean()
        out[1, a] = 0.0
    for i in range(n):
        for j in range(i + 1):
            left = learnt[i, j] + (1.0 if i == j else 0.0)
            for k in range(j):
                left -= L[i, k] * L[j, k]
            L[i, j] = np.sqrt(left) if i == j else left / L[j, j]
        for a in range(4):
            left = learnt[i, n] if a == 0 else (x[i, a - 1] - out[0, a - 1]) / np.sqrt(n)
            for k in range(i):
                left -= L[i, k] * y[k, a]
            y[i, a] = left / L[i, i]
    for a in range(3):
        mean = out[0, a]
        for i in range(n):
            out[0, a] -= y[i, a + 1] * y[i, 0]
            out[1, a] += (1.0 - LEFT) * y[i, a + 1] ** 2 + LEFT * (x[i, a] - mean) ** 2 / n


@njit(cache=True, error_model="numpy")
def informed_along(missed: np.ndarray, x: np.ndarray, dt: float) -> np.ndarray:
    """`informed` (n, 2, 3) at every sample, missed and x (p, n, 3)."""
    out, learnt = np.empty((x.shape[1], 2, 3)), np.zeros((len(x), len(x) + 1))
    for t in range(len(out)):
        learn(learnt, missed[:, t], dt)
        informed(learnt, x[:, t], out[t])
    return out
