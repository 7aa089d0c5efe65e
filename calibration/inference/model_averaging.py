"""Averaging over which of some parameters are needed at all.

    w_m = p(m | data) ~ p(m) p(theta_m = 0 | data) / p(theta_m = 0)        m: a set of parameters that are zero
    p(m) ~ 1 / C(k, |m|)
    theta = sum_m w_m theta_m,     covariance = sum_m w_m (covariance_m + (theta_m - theta) (theta_m - theta)')

theta_m and covariance_m are the Gaussian posterior of all parameters given those zeros. A parameter the data do not
need costs nothing then, one they need stays, and where the data do not decide, both are averaged, by their evidence.
Every number of zeros is equally likely beforehand, and every set of that number: a share of parameters that are needed,
of which nothing is known, is integrated out, so that seven that are zero are evidence against the eighth.
References: Dickey, Ann. Math. Stat. 1971 (density ratio); Hoeting et al., Statistical Science 1999 (averaging);
Scott, Berger, Annals of Statistics 2010 (the prior of sets).

How strongly the data of a fit ask for parameters it does not have.

    r = r_0 + J dtheta + H z + e,     z ~ N(0, I) against z = 0,     e and dtheta as the fit has them
    log B = g' (I + M)^-1 g / 2 - log det(I + M) / 2,     g = -H' r_0,     M = H' (I - A C A') H

H (m, h) are whitened derivatives by the new parameters times their prior widths, A those by the fitted ones, C the
fit's covariance: z is judged after theta has taken what it can. The random errors' sizes stay what they are without z,
so that what they had to absorb is evidence against z: the factor is a lower one.
Reference: Kass, Raftery, JASA 1995.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import betaln

from calibration.inference.map_estimate import Fit

_MOST = 10  # parameters that are asked; of more, those farthest from zero are needed without asking


@dataclass(frozen=True)
class Average:
    """Mean and covariance over all sets.

    Attributes:
        theta: (p,).
        covariance: (p, p).
        needed: (m,) probability that each parameter asked is needed.
    """

    theta: np.ndarray
    covariance: np.ndarray
    needed: np.ndarray


def averaged(theta: np.ndarray, covariance: np.ndarray, asked: np.ndarray, width: np.ndarray) -> Average:
    """Average the posterior N(theta (p,), covariance (p, p)) over which parameters `asked` (m,) are zero.

    `width` (m,) is their prior standard deviation about zero.
    """
    x, S = theta[asked] / width, covariance[np.ix_(asked, asked)] / np.outer(width, width)
    weak = np.sort(np.argsort(np.abs(x) / np.sqrt(np.diag(S)))[:_MOST])
    mine, x, S, k = asked[weak], x[weak], S[np.ix_(weak, weak)], len(weak)
    zero = (np.arange(2**k)[:, None] >> np.arange(k)) & 1
    masked = zero[:, :, None] * zero[:, None] * S + np.eye(k) * (1 - zero)[:, None]
    inverse = np.linalg.inv(masked) * zero[:, :, None] * zero[:, None]
    log_w = -0.5 * (np.einsum("i,mij,j->m", x, inverse, x) + np.linalg.slogdet(masked)[1])
    log_w = log_w + betaln(zero.sum(axis=1) + 1, len(asked) - zero.sum(axis=1) + 1)
    w = np.exp(log_w - log_w.max())
    w = w / w.sum()
    gain = covariance[:, mine] / width[weak]
    off = inverse @ x  # theta_m = theta - gain off_m
    mean = w @ off
    spread = np.einsum("m,mi,mj->ij", w, off - mean, off - mean) - np.einsum("m,mij->ij", w, inverse)
    needed = np.ones(len(asked))
    needed[weak] = 1.0 - w @ zero
    return Average(theta - gain @ mean, covariance + gain @ spread @ gain.T, needed)


def log_bayes_factor(fit: Fit, J: np.ndarray, width: np.ndarray) -> float:
    """Log evidence for parameters with derivatives J (n, d, h) and widths (h,) over none of them."""
    H = (fit.whitener @ J).reshape(-1, len(width)) * width
    AH = fit.J_white.T @ H
    M = np.eye(len(width)) + H.T @ H - AH.T @ fit.covariance @ AH
    g = H.T @ fit.r_white.ravel()
    return float(0.5 * g @ np.linalg.solve(M, g) - 0.5 * np.linalg.slogdet(M)[1])
