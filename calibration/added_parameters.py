"""How strongly the data of a fit ask for parameters it does not have.

    r = r_0 + J dtheta + H z + e,     z ~ N(0, I) against z = 0,     e and dtheta as the fit has them
    log B = g' (I + M)^-1 g / 2 - log det(I + M) / 2,     g = -H' r_0,     M = H' (I - A C A') H

H (m, h) are whitened derivatives by the new parameters times their prior widths, A those by the fitted ones, C the
fit's covariance: z is judged after theta has taken what it can. The random errors' sizes stay what they are without z,
so that what they had to swallow speaks against z: the factor is a lower one.
Reference: Kass, Raftery, JASA 1995.
"""

import numpy as np

from calibration.map_fit import Fit


def log_bayes_factor(fit: Fit, J: np.ndarray, width: np.ndarray) -> float:
    """Log evidence for parameters with derivatives J (n, d, h) and widths (h,) over none of them."""
    H = (fit.whitener @ J).reshape(-1, len(width)) * width
    AH = fit.J_white.T @ H
    M = np.eye(len(width)) + H.T @ H - AH.T @ fit.covariance @ AH
    g = H.T @ fit.r_white.ravel()
    return float(0.5 * g @ np.linalg.solve(M, g) - 0.5 * np.linalg.slogdet(M)[1])
