"""What a force plate says of how a base's wheels were preloaded at the start: a particle filter without resampling.

    w_o ~ exp(-TRUST int log(1 + (F - sum_i A_i' f_i)^2 / (4 sigma^2)) dt),     shift = sum_o w_o (x_o - x_0)

x_0 is of the optimum without preload, x_o of the optimum that started from preload o; summed over axes, integrated as
long as there are readings. Until its first slips a preload shows in the force; what it displaced the base by stays.
Robust, since wrong loads in a jolt outweigh seconds of soft motion. Bases that no plate judges are not shifted.
Reference: Arulampalam, Maskell, Gordon, Clapp, IEEE Trans. Signal Processing 50, 2002 (sequential importance sampling).
"""

import numpy as np

from calibration.numerics.compiled import njit

LEAST_FORCE = np.array([0.1, 0.1, 0.03])  # [N, N, N.m] sigma of a plate's force
LEFT = 0.4  # of a variance that a plate explains: wrong loads hang together, few members are surer than they should be
TRUST = 60.0  # [1/s]: forces of a plate below 20 Hz, whose errors hang together for a twentieth of a second


def noise_at_rest(variance: np.ndarray) -> np.ndarray:
    """sigma (3,) [N, N, N.m] of a plate's force by its variance (3,) at rest."""
    return np.asarray(np.maximum(np.sqrt(variance), LEAST_FORCE))


@njit(cache=True, error_model="numpy")
def weighed(unlikely: np.ndarray, x: np.ndarray, out: np.ndarray) -> None:
    """Shift, its variance by the weights, and the mean square without them, (3, 3), of x (p, 3) about the first."""
    least, total, judged = unlikely.min(), 0.0, unlikely.max() > 0.0
    out[:] = 0.0
    for o in range(len(x)):
        w = np.exp(-TRUST * (unlikely[o] - least))
        total += w
        for a in range(3):
            off = x[o, a] - x[0, a]
            out[0, a] += w * off
            out[1, a] += w * off * off
            out[2, a] += off * off / (len(x) - 1)
    for a in range(3):
        out[0, a] = out[0, a] / total if judged else 0.0
        out[1, a] = out[1, a] / total - out[0, a] ** 2 if judged else 0.0


@njit(cache=True, error_model="numpy")
def weighed_along(missed: np.ndarray, x: np.ndarray, dt: float) -> np.ndarray:
    """`weighed` (n, 3, 3) at every sample, dt [s] apart, by forces that are missing over 2 sigma and x, (p, n, 3)."""
    out, unlikely = np.empty((x.shape[1], 3, 3)), np.zeros(len(x))
    for t in range(len(out)):
        for o in range(len(x)):
            r0, r1, r2 = missed[o, t]
            unlikely[o] += dt * np.log((1.0 + r0 * r0) * (1.0 + r1 * r1) * (1.0 + r2 * r2))
        weighed(unlikely, x[:, t], out[t])
    return out
