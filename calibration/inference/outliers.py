"""A fit that a few wrong postures do not spoil.

    w = (nu + d) / (nu + distance^2)        Student's t, iteratively weighted, scale from the evidence

finds where most postures agree; a posture farther from what all others predict than `limit` is left out, the rest
fitted by least squares, and every posture judged again until the set stays. Those left out have then decided where the
search ended: it starts again with the postures kept, so that the fit is the one there would be without the others, and
a wrong posture that hid behind another is found. One that was left out and that the fit of the others predicts after
all does not contradict them: it comes back, and stays. Weights alone would discard the real, configuration-dependent
errors of a robot; leaving out is for what no robot does.
Reference: Lange, Little, Taylor, JASA 1989.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.special import chdtri

from calibration.inference.map_estimate import Fit, Problem, distances, solve, spread
from calibration.inference.residual import Linearised

_NU = 4.0
_ROUGHLY = 2.0  # times the limit, for what few postures say of all
_FEW = 300  # components that are enough to find where most agree
RARE = 1e-5  # share of good postures beyond the limit, were their errors Gaussian
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
    limit, asked = float(chdtri(d, RARE)), np.ones(n, dtype=bool)
    for _ in range(_ROUNDS):
        rows = np.flatnonzero(asked)
        found = _agreed(partial(_of_these, problem, n, rows), len(rows), d, theta, limit)
        kept = _mask(n, rows[found.kept])
        if kept.all():
            return found
        _, distance = _judged(problem(np.ones(n, dtype=bool)), found.fit, kept.astype(float))
        before, asked = asked, _near(distance, limit)
        if np.array_equal(asked, before):
            break
    return RobustFit(found.fit, kept, distance)


def _of_these(problem: Callable[[np.ndarray], Problem], n: int, rows: np.ndarray, some: np.ndarray) -> Problem:
    """The problem of some, a mask, of the rows of n."""
    return problem(_mask(n, rows[some]))


def _mask(n: int, rows: np.ndarray) -> np.ndarray:
    return np.isin(np.arange(n), rows)


def _agreed(problem: Callable[[np.ndarray], Problem], n: int, d: int, theta: np.ndarray, limit: float) -> RobustFit:
    """The fit of those n postures that lie within the limit of it."""
    everything, some = problem(np.ones(n, dtype=bool)), spread(n, d, _FEW)
    mask = _mask(n, some)
    few = everything if mask.all() else problem(mask)
    found = solve(few, few.linearise(theta), lambda distance: (_NU + d) / (_NU + distance), coarse=True)
    weight = np.zeros(n)
    weight[some] = found.at.weight
    at, distance = _judged(everything, found, weight)
    kept = _near(distance, _ROUGHLY * limit)
    used, back = kept, np.zeros(n, dtype=bool)
    for _ in range(_ROUNDS):
        used = kept
        good = everything if kept.all() else problem(kept)
        found = solve(replace(good, start=found.widths), at.rows(kept))
        if kept.all():
            distance = distances(found.at, found.noise, found.widths, found.covariance)
        else:
            at, distance = _judged(everything, found, kept.astype(float))
        kept = _near(distance, limit) | back
        if np.array_equal(kept, used):
            break
        back = back | (kept & ~used)
    return RobustFit(found, used, distance)


def _near(distance: np.ndarray, limit: float) -> np.ndarray:
    """Postures within the limit, half of them at least."""
    return distance <= max(limit, float(np.median(distance)))


def _judged(problem: Problem, found: Fit, weight: np.ndarray) -> tuple[Linearised, np.ndarray]:
    """The problem at what was found, and the squared distance (n,) of every posture."""
    at = replace(problem.linearise(found.theta), weight=weight)
    return at, distances(at, problem.noise, found.widths, found.covariance)
