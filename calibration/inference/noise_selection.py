"""Which random errors the data need: the sizes of all others are set to the least there is.

    minimise over sets m of groups         -ln p(data | m) + |m| (ln(n) / 2 + ln G)

p(data | m) is the evidence at its best sizes, n the number of postures, G that of all groups, of which one is expected
beforehand: of many one is positive by chance sooner than the one that was asked for. A set is compared with those of
one group more or fewer, in the order the curvature of the evidence promises,

    by adding     1/2 slope^2 / F_gg        by dropping     -1/2 x_g^2 / (F^-1)_gg,      x = v - least v

F its expected curvature by the variances v. It begins with the better of two sets, the hand's own errors and what is
left of all: a marker's noise taken for play of two wrist joints is a maximum of its own, and no single group leads out.
References: Schwarz, Annals of Statistics 1978; Bogdan, Ghosh, Doerge, Genetics 2004 (ln G).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from calibration.inference.marginal_likelihood import Evidence, Widths, refined
from calibration.inference.parameters import Prior
from calibration.inference.residual import Linearised, Noise

_WORTH = 1e-2  # least gain of a change
_DOUBT = 2.0  # a group is dropped on trial though this much seems lost
_TRIALS = 2  # neighbours of a set that are tried before it stands


@dataclass(frozen=True)
class _Set:
    """Groups that may differ from their floor, the widths of highest evidence, the cost, and the evidence there."""

    free: np.ndarray
    widths: Widths
    cost: float
    now: Evidence


@dataclass(frozen=True)
class _Question:
    """The linearised problem, and the groups that may be asked: those `noise.free`."""

    at: Linearised
    noise: Noise
    prior: Prior
    same: float

    @property
    def price(self) -> float:
        """Of a group."""
        return float(0.5 * np.log(len(self.at.r)) + np.log(max(1, self.noise.free.sum())))

    def answered(self, free: np.ndarray, widths: Widths) -> _Set:
        """A set with its best widths."""
        least = replace(widths, noise=np.where(self.noise.free & ~free, self.noise.floor, widths.noise))
        best, now = refined(self.at, self.noise, self.prior, least, self.same, free)
        return _Set(free, best, now.value + self.price * int(free.sum()), now)


def needed(
    at: Linearised, noise: Noise, prior: Prior, widths: Widths, free: np.ndarray | None, same: float
) -> tuple[np.ndarray, Widths]:
    """Which groups (g,) the data need, and the widths then; searched from `free` where that is given.

    `noise.free` are the groups that may be asked, `same` is as `refined` takes it.
    """
    question = _Question(at, noise, prior, same)
    if free is not None:
        start = question.answered(free, widths)
    else:
        common, everything = (question.answered(some, widths) for some in (noise.free & noise.common, noise.free))
        start = min(common, _thinned(question, everything), key=lambda found: found.cost)
    best = _searched(question, start)
    return best.free, best.widths


def _searched(question: _Question, found: _Set) -> _Set:
    """From a set to better neighbours until there is none."""
    while True:
        trials = (question.answered(*neighbour) for neighbour in _neighbours(question, found))
        better = next((trial for trial in trials if trial.cost < found.cost - _WORTH), None)
        if better is None:
            return found
        found = better


def _neighbours(question: _Question, found: _Set) -> Iterator[tuple[np.ndarray, Widths]]:
    """The sets most likely to be better, with widths to begin with."""
    noise, now, price = question.noise, found.now, question.price
    x, promised = found.widths.noise**2 - noise.floor**2, np.full(len(noise.free), np.inf)
    inside, outside = np.flatnonzero(found.free), np.flatnonzero(noise.free & ~found.free & (now.slope < 0.0))
    if inside.size:
        curvature = 1.0 / np.diag(np.linalg.pinv(now.fisher[np.ix_(inside, inside)], hermitian=True))
        promised[inside] = 0.5 * curvature * x[inside] ** 2 - price - _DOUBT
    F = np.diag(now.fisher)
    promised[outside] = -0.5 * now.slope[outside] ** 2 / F[outside] + price
    for g in np.argsort(promised)[:_TRIALS]:
        if promised[g] < 0.0:
            start = found.widths.noise.copy()
            start[g] = np.sqrt(noise.floor[g] ** 2 + max(0.0, -now.slope[g] / F[g]))
            yield found.free ^ (np.arange(len(x)) == g), replace(found.widths, noise=start)


def _thinned(question: _Question, found: _Set) -> _Set:
    """Groups dropped, cheapest first, the others taking over by the curvature, while one costs less than its price."""
    x, free, price = found.widths.noise**2 - question.noise.floor**2, found.free.copy(), question.price
    while free.any():
        left = np.flatnonzero(free)
        inverse = np.linalg.pinv(found.now.fisher[np.ix_(left, left)], hermitian=True)
        cost = 0.5 * x[left] ** 2 / np.diag(inverse)
        k = int(np.argmin(cost))
        if cost[k] > price:
            break
        x[left] = np.maximum(x[left] - inverse[:, k] / inverse[k, k] * x[left[k]], 0.0)
        free[left[k]] = False
    if np.array_equal(free, found.free):
        return found
    sizes = np.sqrt(question.noise.floor**2 + np.maximum(x, 0.0))
    return question.answered(free, replace(found.widths, noise=np.where(free, sizes, found.widths.noise)))
