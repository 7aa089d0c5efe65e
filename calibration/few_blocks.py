"""Intervals where a variance is summed from few parts, each of them uncertain.

nu = (sum_g v_g)^2 / sum_g v_g^2        Satterthwaite's degrees of freedom, v_g what block g expects to add
"""

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

_QUANTILE = 0.975


def widening(v: np.ndarray) -> np.ndarray:
    """Factors (p,) on standard deviations of which 1.96 are to hold 95 %, as Student's do; v (n_blocks, p)."""
    nu = v.sum(axis=0) ** 2 / np.maximum((v**2).sum(axis=0), np.finfo(float).tiny)
    return np.asarray(student.ppf(_QUANTILE, nu) / norm.ppf(_QUANTILE))
