"""Lag between two signals on different clocks.

    y(t) = g x(t - lag) + b + sum_k a_k z_k(t - lag) + sum_k c_k u_k(t) + noise

g, b and the nuisances a, c are eliminated; the lag by Gauss-Newton from a cross-correlation. The residual is not white
(model error), so the variance of the lag sums the autocorrelation of its influence psi_t = [(A'A)^-1 A']_lag r_t:

    var = sum_|k|<L (1 - |k| / L) sum_t psi_t psi_{t+k}
Reference: Newey, West, Econometrica 1987.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy
from scipy.interpolate import make_interp_spline

from calibration.errors import NotEnoughData
from calibration.numerics.robust_covariance import long_run_variance
from calibration.numerics.signals import RATE, Signal

_STEPS = 30
_ENOUGH = 0.5  # share of the motion's variance a lag must explain to be believed [-]
_RANK = 1e-13  # least eigenvalue of a Gram matrix to its largest


@dataclass(frozen=True)
class Lag:
    """Result of one comparison.

    Attributes:
        value: t = s + value [s], s the time on the other clock.
        sigma: Standard deviation [s].
    """

    value: float
    sigma: float


@dataclass(frozen=True)
class Pair:
    """Two signals that show one motion.

    Attributes:
        y: The noisier one, c channels on its own clock.
        x: The other, c channels on its own clock.
        z: Nuisance terms (n_x, k, c) at the instants of x.
        u: Nuisance terms (n_y, k, c) at the instants of y.
    """

    y: Signal
    x: Signal
    z: np.ndarray
    u: np.ndarray

    @property
    def plain(self) -> "Pair":
        """The same without nuisances."""
        return replace(self, z=self.z[:, :0], u=self.u[:, :0])

    def turned(self, Q: np.ndarray) -> "Pair":
        """The same with x on axes turned by Q (c, c)."""
        return replace(self, x=replace(self.x, x=self.x.x @ Q.T))


def coarse_lag(y: Signal, x: Signal) -> float:
    """Lag [s] of highest cross-correlation, means removed, not normalised.

    At the true lag two records of the same finite motion reach sum x^2, which no other lag can (Cauchy-Schwarz).
    """
    c = sum(
        scipy.signal.correlate(a - a.mean(), b - b.mean(), mode="full", method="fft")
        for a, b in zip(y.x.T, x.x.T, strict=True)
    )
    shift = scipy.signal.correlation_lags(len(y.t), len(x.t))[int(np.argmax(c))]
    return float(shift / RATE + y.t[0] - x.t[0])


def fit_lag(pair: Pair, start: float, drift: float = 0.0) -> Lag:
    """Lag of y behind x, from `start` [s].

    With a drift the clocks' rates differ and the lag returned is the one at the middle of y.

    Raises:
        NotEnoughData: Too little overlap, or the two do not show the same motion.
    """
    y, x = pair.y, pair.x
    columns = make_interp_spline(x.t, np.concatenate([x.x[..., None], np.swapaxes(pair.z, 1, 2)], axis=2))
    own = np.swapaxes(pair.u, 1, 2)
    middle = 0.5 * (y.t[0] + y.t[-1])
    lag, step = start, np.inf
    for _ in range(_STEPS):
        s = (y.t - middle) / (1.0 + drift) + middle - lag
        keep = y.valid & (s > x.t[0]) & (s < x.t[-1])
        keep[keep] &= x.valid[np.round((s[keep] - x.t[0]) * RATE).astype(int)]
        if keep.sum() < 2.0 * RATE:
            raise NotEnoughData("the two records overlap for less than two seconds")
        r, slope, explained = _design(y.x[keep], columns(s[keep]), columns(s[keep], 1), own[keep])
        step = float(slope @ r / (slope @ slope))
        lag -= step
        if abs(step) < 1e-7:
            break
    if abs(step) >= 1e-7 or abs(lag - start) > 0.5 or explained < _ENOUGH:
        raise NotEnoughData(
            f"the records do not show the same motion (explained {explained:.2f}, lag moved {lag - start:+.3f} s)"
        )
    psi = (slope * r / (slope @ slope)).reshape(-1, y.x.shape[1]).sum(axis=1)
    return Lag(lag, float(np.sqrt(long_run_variance(psi, RATE))))


def _design(y: np.ndarray, m: np.ndarray, m_dot: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Residual of the nuisances, the derivative by -lag orthogonal to them, and the share of y explained.

    m (n, c, 1 + k) are x and z at t - lag, m_dot their rates, u (n, c, k_u) and y (n, c) are at t.
    """
    n, c, k = m.shape
    one = np.broadcast_to(np.eye(c), (n, c, c))
    A = np.concatenate([m[..., :1] * one, one, m[..., 1:], u], axis=2).reshape(n * c, -1)
    X = inverse_root(A.T @ A)

    def explained(x: np.ndarray) -> np.ndarray:
        """Coefficients of x (n c,), the second time of what rounding left."""
        found = X @ (X.T @ (x @ A))
        return np.asarray(found + X @ (X.T @ ((x - A @ found) @ A)))

    a = explained(y.ravel())
    r, gains, small = y.ravel() - A @ a, a[:c], a[2 * c : 2 * c + k - 1]
    slope = (m_dot[..., 0] * gains + m_dot[..., 1:] @ small).ravel()
    slope -= A @ explained(slope)
    total = float(((y - y.mean(axis=0)) ** 2).sum())
    return r, slope, 1.0 - float(r @ r) / max(total, np.finfo(float).tiny)


def inverse_root(gram: np.ndarray) -> np.ndarray:
    """X (p, k) with X' A'A X = 1, where A X spans the columns of A, from A'A (p, p)."""
    size = np.sqrt(np.diag(gram))
    size = np.where(size > 0.0, size, 1.0)
    square, V = np.linalg.eigh(gram / size / size[:, None])
    kept = square > _RANK * square[-1]
    return np.asarray(V[:, kept] / np.sqrt(square[kept]) / size[:, None])
