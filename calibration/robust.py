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

from calibration.linearised import Linearised
from calibration.map_fit import Fit, Problem, distances, solve, spread

_NU = 4.0
_ROUGHLY = 2.0  # times the limit, for what few postures say of all
_FEW = 300  # components that are enough to find where most agree
_RARE = 1e-5  # share of good postures beyond the limit, were their errors Gaussian
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


def robust_fit(problem: Callable[[np.ndarray], Problem], n: int, d: int, theta: np.ndarray) -> RobustFit:
    """Fit from theta (p,); `problem` makes that of some of the n postures of d components, given as a mask."""
    everything, some = problem(np.ones(n, dtype=bool)), spread(n, d, _FEW)
    mask = np.isin(np.arange(n), some)
    few = everything if mask.all() else problem(mask)
    limit = float(chi2.isf(_RARE, d))
    found = solve(few, few.linearise(theta), lambda distance: (_NU + d) / (_NU + distance), hasty=True)
    weight = np.zeros(n)
    weight[some] = found.noise.weight
    at, distance = _judged(everything, found, weight)
    kept = _near(distance, _ROUGHLY * limit)
    for _ in range(_ROUNDS):
        good = everything if kept.all() else problem(kept)
        found = solve(replace(good, widths=found.widths), at.rows(kept))
        if kept.all():
            distance = distances(found.at, found.noise, found.widths, found.covariance)
        else:
            at, distance = _judged(everything, found, kept.astype(float))
        if np.array_equal(_near(distance, limit), kept):
            break
        kept = _near(distance, limit)
    return RobustFit(found, kept, distance)


def _near(distance: np.ndarray, limit: float) -> np.ndarray:
    """Postures within the limit, half of them at least."""
    return distance <= max(limit, float(np.median(distance)))


def _judged(problem: Problem, found: Fit, weight: np.ndarray) -> tuple[Linearised, np.ndarray]:
    """The problem at what was found, and the squared distance (n,) of every posture."""
    at = problem.linearise(found.theta)
    noise = replace(problem.sources(at), weight=weight)
    return at, distances(at, noise, found.widths, found.covariance)
