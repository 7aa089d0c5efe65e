"""Sizes of random errors and widths of priors that make the data most likely (type-II maximum likelihood).

    r = r_0 + J (theta - theta_0) + e,   e_i ~ N(0, C_i / w_i),   C_i = sum_m v_g(m) b_im b_im'
    theta_j ~ N(nominal_j, f_h(j) tolerance_j^2)

theta is integrated out. Each source of noise b_m (n, d) has the variance v of its group: one of a joint's reading, of
the hand's position, of its rotation, of the markers. Variances take Fisher scoring steps down to a floor, prior
factors f MacKay's fixed point, kept near 1 as by `_NEAR_ONE` parameters that deviate by exactly their tolerance.
References: MacKay, Neural Computation 1992; Patterson, Thompson, Biometrika 1971 (restricted likelihood).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import blas, lapack

from calibration.inference.parameters import Prior
from calibration.inference.residual import Linearised, Noise

_NEAR_ONE = 20.0
_STEPS = 30
_UNDAMPED = 1e-3  # of a step's curvature: too little to matter
_LARGEST = 1.0  # of a standard deviation [rad, m]: data that ask for more do not belong to the model
_NEGLIGIBLE = 10.0  # standard deviations below this many floors need not stand still


@dataclass(frozen=True)
class Hyperparameters:
    """Sizes of random errors and factors on priors.

    Attributes:
        noise: (g,) standard deviation of each group of noise sources.
        prior: (h,) factor on the tolerances of each group of parameters [-].
    """

    noise: np.ndarray
    prior: np.ndarray


@dataclass(frozen=True)
class LogMarginal:
    """Minus the log marginal likelihood, its derivatives by the variances, and the theta it would give."""

    value: float
    slope: np.ndarray
    fisher: np.ndarray
    off: np.ndarray
    spread: np.ndarray


def moved_by(old: np.ndarray, new: np.ndarray, least: np.ndarray | float) -> float:
    """Largest change of a logarithm; what is below `least` counts as that."""
    return float(np.abs(np.log(np.maximum(new, least) / np.maximum(old, least))).max(initial=0.0))


def _scored(now: LogMarginal, floor: np.ndarray, free: np.ndarray, s: np.ndarray, damping: float) -> np.ndarray:
    """Standard deviations after one Fisher scoring step of the variances that are free and not at their floor."""
    v, low = s**2, floor**2
    free = free & ~((v <= low * 1.0000001) & (now.slope > 0.0))
    if not free.any():
        return s
    F = now.fisher[np.ix_(free, free)]
    F = F + np.diag(damping * np.diag(F) + np.finfo(float).tiny)
    step = np.zeros_like(v)
    step[free] = -np.linalg.solve(F, now.slope[free])
    return np.sqrt(np.clip(v + np.clip(step, -0.97 * v, 20.0 * v + 4.0 * low), low, np.maximum(_LARGEST**2, low)))


def _prior_factors(prior: Prior, now: LogMarginal, f: np.ndarray) -> np.ndarray:
    """MacKay's fixed point for the factors on squared tolerances."""
    new = np.array(f)
    for h in range(len(f)):
        mine = prior.group == h
        unit = prior.tolerance[mine] ** 2
        known = max(0.0, float((1.0 - now.spread[mine] / (f[h] * unit)).sum()))
        new[h] = (float((now.off[mine] ** 2 / unit).sum()) + _NEAR_ONE) / (known + _NEAR_ONE)
    return new


def inverse_and_log_det(information: np.ndarray) -> tuple[np.ndarray, float]:
    """Inverse and log determinant of a symmetric matrix; directions without information get a huge variance."""
    root, log_det = root_and_log_det(information)
    return root @ root.T, log_det


def root_and_log_det(information: np.ndarray) -> tuple[np.ndarray, float]:
    """Upper triangular R with R R' the inverse of a symmetric matrix, and its log determinant.

    Directions without information get a huge variance.
    """
    factor, failed = lapack.dpotrf(information, lower=True)
    if not failed:
        diagonal = np.diagonal(factor)
        if diagonal.min() > 1e-7 * diagonal.max():
            return lapack.dtrtri(factor, lower=True)[0].T, 2.0 * float(np.log(diagonal).sum())
    values, vectors = np.linalg.eigh(information)
    values = np.maximum(values, 1e-15 * values[-1])
    _, upper = np.linalg.qr((vectors / np.sqrt(values)).T[:, ::-1])
    return upper[::-1, ::-1].T, float(np.log(values).sum())


def times_upper(A: np.ndarray, R: np.ndarray) -> np.ndarray:
    """A R of A (m, p) and an upper triangular R (p, p), in half the operations."""
    return blas.dtrmm(1.0, R, A.T, trans_a=1).T


def maximised(  # noqa: PLR0913  the parts of one problem
    at: Linearised,
    noise: Noise,
    prior: Prior,
    widths: Hyperparameters,
    same: float,
    free: np.ndarray | None = None,
    present: bool = False,
) -> tuple[Hyperparameters, LogMarginal]:
    """Hyperparameters of highest evidence for the linearised problem, to a change of their logarithms below `same`.

    Only the groups `free` (g,) of those that are, if given, are changed; the evidence, too, is to that accuracy.
    """
    damping, now = _UNDAMPED, log_marginal(at, noise, prior, widths, present)
    free = noise.free if free is None else free
    for _ in range(_STEPS):
        f = _prior_factors(prior, now, widths.prior)
        v = _scored(now, noise.floor, free, widths.noise, damping)
        moved = max(moved_by(widths.noise, v, _NEGLIGIBLE * noise.floor), moved_by(widths.prior, f, 1e-12) / 2.0)
        if moved < same and damping <= _UNDAMPED:
            return Hyperparameters(v, f), now
        trial = log_marginal(at, noise, prior, Hyperparameters(v, f), present)
        if trial.value > now.value + 1e-9 * abs(now.value) and damping < 1e6:
            damping = max(10.0 * damping, 1e-2)
            continue
        damping = 0.1 * damping
        widths, now = Hyperparameters(v, f), trial
        if moved < same:
            break
    return widths, now


def log_marginal(
    at: Linearised, noise: Noise, prior: Prior, widths: Hyperparameters, present: bool = False
) -> LogMarginal:
    """Evaluate; the slope is by variance, the information that of the postures taken one by one.

    Both are zero for groups that are not free.
    """
    root, scale = noise.roots(at.B, widths.noise), prior.scale
    n, d, p = at.J.shape
    some = np.sqrt(at.weight)[:, None]
    A = (root @ at.J) * (some[..., None] * scale)
    r = (root @ at.r[..., None])[..., 0] * some
    flat, precision = A.reshape(n * d, p), prior.precision(widths.prior) * scale**2
    off = (at.theta - prior.nominal) / scale
    spread, log_det = root_and_log_det(flat.T @ flat + np.diag(precision))
    step = spread @ (spread.T @ (flat.T @ r.ravel() + precision * off))
    rest, off = r - (flat @ step).reshape(n, d), off - step
    free = noise.free[noise.group]
    K, known = root @ at.B[:, :, free], times_upper(flat, spread).reshape(n, d, p)
    trace = (K * (K - known @ (np.swapaxes(known, 1, 2) @ K))).sum(axis=(0, 1))
    slope = 0.5 * (trace - ((K * rest[..., None]).sum(axis=1) ** 2).sum(axis=0))
    together = 0.5 * ((np.swapaxes(K, 1, 2) @ K) ** 2).sum(axis=0)
    groups = np.eye(len(noise.floor))[noise.group[free]]
    value = log_det - 2.0 * float(np.log(np.diagonal(root, axis1=1, axis2=2)).sum())
    value += float((rest**2).sum() + (precision * off**2).sum()) + prior.constant(widths.prior, _NEAR_ONE)
    v = np.where(noise.free & present, widths.noise, np.inf) ** 2
    value -= float(np.log(v[np.isfinite(v)]).sum())
    by_v, fisher = groups.T @ slope - 0.5 / v, groups.T @ together @ groups + np.diag(0.5 / v**2)
    return LogMarginal(0.5 * value, by_v, fisher, off * scale, (spread**2).sum(axis=1) * scale**2)
