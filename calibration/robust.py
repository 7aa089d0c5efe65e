"""A fit that a few wrong postures do not spoil.

    w = (nu + d) / (nu + distance^2)        Student's t, iteratively weighted, scale from the evidence

finds where most postures agree; a posture farther from what all others predict than `limit` is left out, the rest
fitted by least squares, and every posture judged again until the set stands. Weights alone would discard the real,
configuration-dependent errors of a robot; leaving out is for what no robot does.
Reference: Lange, Little, Taylor, JASA 1989.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from calibration.map_fit import Fit, Problem, distances, solve

_NU = 4.0
_RARE = 1e-5  # share of good postures beyond the limit, were their errors Gaussian
_MANY = 160  # postures that are enough to find where most agree
_ROUNDS = 6


@dataclass(frozen=True)
class RobustFit:
    """A fit and the postures it is of.

    Attributes:
        fit: Of the postures kept.
        kept: (n,) which they are.
        distance: (n,) of every posture from what the others predict [-], squared Mahalanobis.
    """

    fit: Fit
    kept: np.ndarray
    distance: np.ndarray


def robust_fit(problem: Callable[[np.ndarray], Problem], n: int, theta: np.ndarray) -> RobustFit:
    """Fit from theta (p,); `problem` makes that of some of the n postures, given as a mask."""
    everything, some = problem(np.ones(n, dtype=bool)), np.zeros(n, dtype=bool)
    some[np.linspace(0, n - 1, min(n, _MANY)).astype(int)] = True
    few = everything if some.all() else problem(some)
    d = few.linearise(theta).r.shape[1]
    limit = float(chi2.isf(_RARE, d))
    found = solve(few, theta, lambda distance: (_NU + d) / (_NU + distance), hasty=True)
    weight = np.zeros(n)
    weight[some] = found.noise.weight
    distance = _judged(everything, found, weight)
    kept = _near(distance, limit)
    for _ in range(_ROUNDS):
        good = everything if kept.all() else problem(kept)
        found = solve(replace(good, widths=found.widths), found.theta)
        if kept.all():
            distance = distances(found.at, found.noise, found.widths, found.covariance, np.zeros(len(theta)))
        else:
            distance = _judged(everything, found, kept.astype(float))
        if np.array_equal(_near(distance, limit), kept):
            break
        kept = _near(distance, limit)
    return RobustFit(found, kept, distance)


def _near(distance: np.ndarray, limit: float) -> np.ndarray:
    """Postures within the limit, half of them at least."""
    return distance <= max(limit, float(np.median(distance)))


def _judged(problem: Problem, found: Fit, weight: np.ndarray) -> np.ndarray:
    at = problem.linearise(found.theta)
    noise = replace(problem.sources(at), weight=weight)
    return distances(at, noise, found.widths, found.covariance, np.zeros(len(found.theta)))
