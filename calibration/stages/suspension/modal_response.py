"""Response of the base on its wheels to a wrench, exact between samples.

    K x + C dx/dt + M d2x/dt2 = w        =>        x = sum_m a_m (b_m' w) / (1 + tau_m s)

M = 0 where w is the wrench on the floor. Each mode is a first-order lag, integrated exactly for a wrench that is linear
between samples: stiff modes (tau << step) cost nothing and cannot blow up. tau = 0 is a spring without damper.

    y_k+1 = e y_k + b0 u_k + b1 u_k+1,   e = exp(-h / tau),   b1 = 1 - tau (1 - e) / h,   b0 = 1 - e - b1
"""

from dataclasses import dataclass

import numpy as np

from calibration.numerics.compiled import njit
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

    def lagged(self, u: np.ndarray, step: float, rows: np.ndarray) -> np.ndarray:
        """Some rows of channels u (n, c) through every mode's lag, (r, c, k); in balance with the first one before."""
        e, b1 = self._factors(step)
        return np.asarray(_lagged(np.ascontiguousarray(u), e, b1, rows))

    def advanced(
        self, y: np.ndarray, u_before: np.ndarray, w: np.ndarray, step: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """One step [s] under a wrench w (6,): the modes' lags y (k,), what drives them u (k,), displacement x (6,)."""
        x = np.empty(6)
        found = advance_modes((self.a, self.b, self.tau), y, u_before, w, step, x)
        return found[0], found[1], x

    def _factors(self, step: float) -> tuple[np.ndarray, np.ndarray]:
        """e and b1 (k,) of every mode."""
        ratio = self.tau / step
        late = np.abs(ratio) > _INSTANT
        e = np.where(late, np.exp(-1.0 / np.where(late, ratio, 1.0)), 0.0)
        return e, 1.0 - ratio * (1.0 - e)

    def respond(self, w: np.ndarray, step: float) -> np.ndarray:
        """Displacement (n, 6) [m, rad] under w (n, 6) [N, N.m], sampled every `step` [s]."""
        y = _responses(w @ self.b.T, *self._factors(step))
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


@njit(cache=True, error_model="numpy")
def advance_modes(
    of: tuple[np.ndarray, np.ndarray, np.ndarray],
    y: np.ndarray,
    u_before: np.ndarray,
    w: np.ndarray,
    step: float,
    x: np.ndarray,
) -> np.ndarray:
    """`Modes.advanced` of modes (a, b, tau): y and u (2, k); x (6,) is filled."""
    (a, b, tau), modes = of, np.empty((2, len(y)), dtype=np.complex128)
    for i in range(6):
        x[i] = 0.0
    for m in range(len(tau)):
        u, e, ratio = 0.0j, 0.0j, tau[m] / step
        for i in range(6):
            u += b[m, i] * w[i]
        if abs(ratio) > _INSTANT:
            e = np.exp(-1.0 / ratio)
        b1 = 1.0 - ratio * (1.0 - e)
        modes[0, m], modes[1, m] = e * y[m] + (1.0 - e - b1) * u_before[m] + b1 * u, u
        for i in range(6):
            x[i] += (a[i, m] * modes[0, m]).real
    return modes


@njit(cache=True, error_model="numpy")
def _lagged(u: np.ndarray, e: np.ndarray, b1: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """`Modes.lagged`."""
    out, y = np.empty((len(rows), u.shape[1], len(e)), dtype=np.complex128), np.empty(len(e), dtype=np.complex128)
    for c in range(u.shape[1]):
        for m in range(len(e)):
            y[m] = u[0, c]
        n = 0
        for i in range(len(u)):
            if i > 0:
                for m in range(len(e)):
                    y[m] = e[m] * y[m] + (1.0 - e[m] - b1[m]) * u[i - 1, c] + b1[m] * u[i, c]
            if n < len(rows) and rows[n] == i:
                for m in range(len(e)):
                    out[n, c, m] = y[m]
                n += 1
    return out


@njit(cache=True, error_model="numpy")
def _responses(u: np.ndarray, e: np.ndarray, b1: np.ndarray) -> np.ndarray:
    """Every mode's lag of its own channel of u (n, k), in balance with the first sample before."""
    y = np.empty_like(u)
    for m in range(len(e)):
        y[0, m] = u[0, m]
        for i in range(1, len(u)):
            y[i, m] = e[m] * y[i - 1, m] + (1.0 - e[m] - b1[m]) * u[i - 1, m] + b1[m] * u[i, m]
    return y


def predicted(K: np.ndarray, C: np.ndarray, forcing: Forcing) -> np.ndarray:
    """Displacement (n, 6) [m, rad] of a base on springs K and dampers C; inf where it does not settle."""
    modes = modes_of(K + forcing.tangent, C, forcing.inertia)
    if not np.isfinite(modes.settling):
        return np.full(forcing.w.shape, np.inf)
    return modes.respond(forcing.w, 1.0 / RATE)
