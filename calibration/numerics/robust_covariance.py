"""Covariance of a least-squares fit to time series whose residuals hang together in time.

    theta - truth = H^-1 sum_t J_t' r_t                               H = sum_t J_t' J_t (+ prior)
    covariance    = c W (sum_g u_g u_g') W',      u_g = (1 - M_g)^-1/2 W' g_g,   M_g = W' H_g W,   W W' = H^-1

g_g and H_g are sums over block g, a stretch of one series. Blocks last `LONG` correlation times at least,

    T = 1 + 2 sum_k rho_k,       sums of two neighbouring rho as long as they are positive (initial positive sequence)

and are no more than `MANY`, so that what hangs together across their ends is little; c gives that little back,

    c = sum_k rho_k / sum_k (1 - |k| / L) rho_k

(1 - M_g)^-1/2 gives back what a block's residuals lost to the parameters. A variance summed from few blocks is itself
uncertain: standard deviations are Student's, so that 1.96 of them hold 95 %, with for each parameter

    nu = (sum_g v_g)^2 / sum_g v_g^2,    v_g = (H^-1 H_g H^-1)_jj

degrees of freedom. Give samples at the Nyquist rate of whatever low-passed them; more add nothing.
References: Bell, McCaffrey, Survey Methodology 2002; Geyer, Statistical Science 1992; Carlstein, Ann. Stat. 1986.

Intervals where a variance is summed from few parts, each of them uncertain.

nu = (sum_g v_g)^2 / sum_g v_g^2        Satterthwaite's degrees of freedom, v_g what block g expects to add
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy
from scipy.special import ndtri, stdtrit

from calibration.errors import NotEnoughData, ShapeError

LONG = 3.0  # shortest block [correlation times]
ENOUGH = 30  # blocks
MANY = 60
_UNKNOWN = 1e-9  # smallest over largest singular value of scaled derivatives [-]
_LEAST = 1e-3  # share of a block's residuals that the parameters leave it, at least [-]
_QUANTILE = 0.975
MEMORY = 1.0  # [s] residuals farther apart count as independent


@dataclass(frozen=True)
class BlockCovariance:
    """A covariance by blocks.

    Attributes:
        covariance: (p, p); 1.96 standard deviations hold 95 %.
        blocks: Their number.
        length: Of a block [samples].
        correlation: T [samples].
    """

    covariance: np.ndarray
    blocks: int
    length: int
    correlation: float


def block_covariance(
    J: Sequence[np.ndarray], r: Sequence[np.ndarray], prior: np.ndarray | None = None
) -> BlockCovariance:
    """Covariance at the solution of a least-squares fit.

    Args:
        J: (n, d, p) whitened derivatives of each series, in order of time, evenly sampled.
        r: (n, d) its whitened residuals.
        prior: (p,) information of a prior, which H holds and no block.

    Raises:
        ShapeError: A series' residuals do not belong to its derivatives.
        NotEnoughData: All samples make one block.
    """
    for rows, of_series in zip(J, r, strict=True):
        if rows.ndim != 3 or of_series.shape != rows.shape[:2]:
            raise ShapeError("r", of_series.shape, rows.shape[:2])
    W = _inverse_root(J, np.zeros(J[0].shape[2]) if prior is None else prior)
    white = [rows @ W for rows in J]
    u = [np.einsum("ndp,nd->np", rows, of_series) for rows, of_series in zip(white, r, strict=True)]
    rho = correlations([x for x in u if len(x) > 1])
    n, T = sum(len(x) for x in u), float(rho[0] + 2.0 * rho[1:].sum())
    length = int(np.ceil(max(LONG * T, n / MANY)))
    blocks = [(k, part) for k, x in enumerate(u) for part in _parts(len(x), length)]
    if len(blocks) < 2:
        raise NotEnoughData(f"{n} samples with a correlation time of {T:.0f} make one block; record longer")
    g = np.array([u[k][part].sum(axis=0) for k, part in blocks])
    M = np.array([(A := white[k][part].reshape(-1, W.shape[1])).T @ A for k, part in blocks])
    share, V = np.linalg.eigh(M)
    left = np.sqrt(np.maximum(1.0 - share, _LEAST))
    g = (V @ ((np.swapaxes(V, 1, 2) @ g[..., None])[..., 0] / left)[..., None])[..., 0]
    v = ((W @ M) * W).sum(axis=2)
    wider = widening(v) * np.sqrt(_across_ends(rho, length))
    return BlockCovariance(np.outer(wider, wider) * (W @ (g.T @ g) @ W.T), len(g), length, T)


def correlations(u: Sequence[np.ndarray]) -> np.ndarray:
    """Autocorrelation rho_0 = 1, rho_1, ... of series u (n, p), all columns alike: its initial positive part."""
    if not u:
        return np.ones(1)
    size = np.sqrt(np.maximum(np.sum([(x**2).sum(axis=0) for x in u], axis=0), np.finfo(float).tiny))
    longest = max(len(x) for x in u)
    padded = 2 ** int(np.ceil(np.log2(2 * longest)))
    power = sum((np.abs(np.fft.rfft(x / size, padded, axis=0)) ** 2).sum(axis=1) for x in u)
    rho = np.fft.irfft(power, padded)[: longest - longest % 2]
    if len(rho) < 2 or rho[0] <= 0.0:
        return np.ones(1)
    pairs = (rho / rho[0]).reshape(-1, 2).sum(axis=1)
    positive = len(pairs) if (pairs > 0.0).all() else int(np.argmin(pairs > 0.0))
    return np.asarray(rho[: max(1, 2 * positive)] / rho[0])


def _across_ends(rho: np.ndarray, length: int) -> float:
    """c of blocks of `length` samples."""
    lag = np.arange(len(rho))
    twice = np.where(lag > 0, 2.0, 1.0) * rho
    return float(twice.sum() / max((twice * np.clip(1.0 - lag / length, 0.0, None)).sum(), 0.5 * twice.sum()))


def _parts(n: int, length: int) -> list[slice]:
    """Blocks of a series of n samples, none shorter than `length` unless the series is."""
    m = max(1, n // length)
    return [slice(a, b) for a, b in pairwise(np.linspace(0, n, m + 1).astype(int).tolist())]


def _inverse_root(J: Sequence[np.ndarray], prior: np.ndarray) -> np.ndarray:
    """W (p, k) with W W' = H^-1; without the directions of which nothing is known."""
    A = np.concatenate([*(rows.reshape(-1, rows.shape[2]) for rows in J), np.diag(np.sqrt(prior))])
    scale = np.maximum(np.linalg.norm(A, axis=0), np.finfo(float).tiny)
    _, values, Vt = np.linalg.svd(np.linalg.qr(A / scale, mode="r"))
    known = values > _UNKNOWN * values[0]
    return np.asarray((Vt[known].T / values[known]) / scale[:, None])


def widening(v: np.ndarray) -> np.ndarray:
    """Factors (p,) on standard deviations of which 1.96 are to hold 95 %, as Student's do; v (n_blocks, p)."""
    nu = v.sum(axis=0) ** 2 / np.maximum((v**2).sum(axis=0), np.finfo(float).tiny)
    return np.asarray(stdtrit(nu, _QUANTILE) / ndtri(_QUANTILE))


def covering_sigma(errors: np.ndarray) -> np.ndarray:
    """Standard deviations (p,) of which 1.96 hold 95 % of errors (n, p), or of others like them; their rms at least.

    Of errors most of which are small 1.96 rms hold fewer. Other errors are below the k-th of n in k / (n + 1) of cases.
    """
    if not len(errors):
        return np.zeros(errors.shape[1])
    within = np.quantile(np.abs(errors), 2.0 * _QUANTILE - 1.0, axis=0, method="weibull")
    return np.asarray(np.maximum(np.sqrt((errors**2).mean(axis=0)), within / ndtri(_QUANTILE)))


def long_run_variance(psi: np.ndarray, rate: float) -> float:
    """Variance of sum(psi), sampled at `rate` [Hz], allowing for autocorrelation up to `MEMORY` (Bartlett weights)."""
    return float(long_run_covariance(psi[:, None], rate)[0, 0])


def long_run_covariance(psi: np.ndarray, rate: float) -> np.ndarray:
    """The same of the sums of psi (n, c): covariance (c, c)."""
    n, c = psi.shape
    weight = np.clip(1.0 - np.abs(scipy.signal.correlation_lags(n, n)) / (MEMORY * rate), 0.0, None)
    both = [[weight @ scipy.signal.correlate(a, b, mode="full", method="fft") for b in psi.T] for a in psi.T]
    return np.array(both).reshape(c, c)
