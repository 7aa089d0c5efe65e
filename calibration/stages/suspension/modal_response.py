"""Response of the base on its wheels to a wrench, exact between samples.

    K x + C dx/dt + M d2x/dt2 = w        =>        x = sum_m a_m (b_m' w) / (1 + tau_m s)

M = 0 where w is what the floor feels. Each mode is a first-order lag, integrated exactly for a wrench that is linear
between samples: stiff modes (tau << step) cost nothing and cannot blow up. tau = 0 is a spring without damper.

    y_k+1 = e y_k + b0 u_k + b1 u_k+1,   e = exp(-h / tau),   b1 = 1 - tau (1 - e) / h,   b0 = 1 - e - b1
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from calibration.numerics.signals import RATE
from calibration.stages.suspension.base_response import Forcing

_INSTANT = 1e-3  # time constants below this share of the step are none


@dataclass(frozen=True)
class Modes:
    """Modes of the base, k of them, conjugate ones both present.

    Attributes:
        a: (6, k) complex, displacement of each mode.
        b: (k, 6) complex, how the wrench drives it.
        tau: (k,) complex time constants [s].
    """

    a: np.ndarray
    b: np.ndarray
    tau: np.ndarray

    @property
    def settling(self) -> float:
        """Time constant of the slowest mode [s]; inf where one does not settle."""
        rates = [float((1.0 / t).real) for t in self.tau if abs(t) > 1e-12]
        slowest = min(rates, default=np.inf)
        return 1.0 / slowest if slowest > 0.0 else np.inf

    def lagged(self, u: np.ndarray, step: float) -> np.ndarray:
        """Channels u (n, c) through every mode's lag, (n, c, k); in balance with their first sample before."""
        return np.stack([_lag(u, tau, step) for tau in self.tau], axis=2)

    def advanced(self, y: np.ndarray, u_before: np.ndarray, u: np.ndarray, step: float) -> np.ndarray:
        """Every mode's lag (k,) one step [s] on, from y (k,), driven linearly from u_before to u (k,)."""
        ratio = self.tau / step
        late = np.abs(ratio) > _INSTANT
        e = np.where(late, np.exp(-1.0 / np.where(late, ratio, 1.0)), 0.0)
        b1 = 1.0 - ratio * (1.0 - e)
        return np.asarray(e * y + (1.0 - e - b1) * u_before + b1 * u)

    def respond(self, w: np.ndarray, step: float) -> np.ndarray:
        """Displacement (n, 6) [m, rad] under w (n, 6) [N, N.m], sampled every `step` [s]."""
        u = w @ self.b.T
        y = np.stack([_lag(u[:, m], tau, step) for m, tau in enumerate(self.tau)], axis=1)
        return np.asarray((y @ self.a.T).real)


def modes_of(K: np.ndarray, C: np.ndarray, M: np.ndarray) -> Modes:
    """Modes of a stiffness K, damping C and inertia M, all (6, 6) about one point; M may be zero."""
    if not M.any():
        tau, V = np.linalg.eig(np.linalg.solve(K, C))
        b = np.linalg.solve(V, np.linalg.inv(K))
        return Modes(V.astype(complex), b.astype(complex), tau.astype(complex))
    zero, eye = np.zeros((6, 6)), np.eye(6)
    A = np.block([[zero, eye], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    rates, V = np.linalg.eig(A)
    tau = -1.0 / rates.astype(complex)
    b = tau[:, None] * np.linalg.solve(V, np.vstack([zero, np.linalg.inv(M)]))
    return Modes(V[:6].astype(complex), b, tau)


def _lag(u: np.ndarray, tau: complex, step: float) -> np.ndarray:
    ratio = tau / step
    e = np.exp(-1.0 / ratio) if abs(ratio) > _INSTANT else 0.0
    b1 = 1.0 - ratio * (1.0 - e)
    return np.asarray(lfilter([b1, 1.0 - e - b1], [1.0, -e], u, axis=0, zi=((1.0 - b1) * u[0])[None])[0])


def predicted(K: np.ndarray, C: np.ndarray, forcing: Forcing) -> np.ndarray:
    """Displacement (n, 6) [m, rad] of a base on springs K and dampers C; inf where it does not settle."""
    modes = modes_of(K + forcing.tangent, C, forcing.inertia)
    if not np.isfinite(modes.settling):
        return np.full(forcing.w.shape, np.inf)
    return modes.respond(forcing.w, 1.0 / RATE)
