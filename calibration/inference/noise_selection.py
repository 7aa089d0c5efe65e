"""Which random errors the data need: the sizes of all others are set to the least there is.

    minimise over sets m of groups         -ln p(data | m) + |m| (ln(n) / 2 + ln G)

p(data | m) is the evidence at its best sizes, n the number of postures, G that of all groups, of which one is expected
beforehand: of many one is positive by chance sooner than the one that was asked for. A set is compared with those of
one group more or fewer, in the order the curvature of the evidence promises,

    by adding     1/2 slope^2 / F_gg        by dropping     -1/2 x_g^2 / (F^-1)_gg,      x = v - least v

F its expected curvature by the variances v. It begins with the better of two sets, the hand's own errors and what is
left of all: a marker's noise taken for backlash of two wrist joints is a maximum of its own, and no single group leads
out.
References: Schwarz, Annals of Statistics 1978; Bogdan, Ghosh, Doerge, Genetics 2004 (ln G).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from calibration.inference.marginal_likelihood import Hyperparameters, LogMarginal, maximised
from calibration.inference.parameters import Prior
from calibration.inference.residual import Linearised, Noise

_WORTH = 1e-2  # least gain of a change
_DOUBT = 2.0  # a group is dropped on trial though this much seems lost
_TRIALS = 2  # neighbours of a set that are tried before it is kept


@dataclass(frozen=True)
class _Set:
    """Groups that may differ from their floor, the widths of highest evidence, the cost, and the evidence there."""

    free: np.ndarray
    widths: Hyperparameters
    cost: float
    now: LogMarginal


@dataclass(frozen=True)
class _Search:
    """The linearised problem, and the groups that may be asked: those `noise.free`."""

    at: Linearised
    noise: Noise
    prior: Prior
    same: float

    @property
    def price(self) -> float:
        """Of a group."""
        return float(0.5 * np.log(len(self.at.r)) + np.log(max(1, self.noise.free.sum())))

    def maximised_over(self, free: np.ndarray, widths: Hyperparameters) -> _Set:
        """A set with its best widths."""
        least = replace(widths, noise=np.where(self.noise.free & ~free, self.noise.floor, widths.noise))
        best, now = maximised(self.at, self.noise, self.prior, least, self.same, free)
        return _Set(free, best, now.value + self.price * int(free.sum()), now)


def selected(
    at: Linearised, noise: Noise, prior: Prior, widths: Hyperparameters, free: np.ndarray | None, same: float
) -> tuple[np.ndarray, Hyperparameters]:
    """Which groups (g,) the data need, and the widths then; searched from `free` where that is given.

    `noise.free` are the groups that may be asked, `same` is as `refined` takes it.
    """
    search = _Search(at, noise, prior, same)
    if free is not None:
        start = search.maximised_over(free, widths)
    else:
        common, everything = (search.maximised_over(some, widths) for some in (noise.free & noise.common, noise.free))
        start = min(common, _backward_eliminated(search, everything), key=lambda found: found.cost)
    best = _searched(search, start)
    return best.free, best.widths


def _searched(search: _Search, found: _Set) -> _Set:
    """From a set to better neighbours until there is none."""
    while True:
        trials = (search.maximised_over(*neighbour) for neighbour in _neighbours(search, found))
        better = next((trial for trial in trials if trial.cost < found.cost - _WORTH), None)
        if better is None:
            return found
        found = better


def _neighbours(search: _Search, found: _Set) -> Iterator[tuple[np.ndarray, Hyperparameters]]:
    """The sets most likely to be better, with widths to begin with."""
    noise, now, price = search.noise, found.now, search.price
    x, expected = found.widths.noise**2 - noise.floor**2, np.full(len(noise.free), np.inf)
    inside, outside = np.flatnonzero(found.free), np.flatnonzero(noise.free & ~found.free & (now.slope < 0.0))
    if inside.size:
        curvature = 1.0 / np.diag(np.linalg.pinv(now.fisher[np.ix_(inside, inside)], hermitian=True))
        expected[inside] = 0.5 * curvature * x[inside] ** 2 - price - _DOUBT
    F = np.diag(now.fisher)
    expected[outside] = -0.5 * now.slope[outside] ** 2 / F[outside] + price
    for g in np.argsort(expected)[:_TRIALS]:
        if expected[g] < 0.0:
            start = found.widths.noise.copy()
            start[g] = np.sqrt(noise.floor[g] ** 2 + max(0.0, -now.slope[g] / F[g]))
            yield found.free ^ (np.arange(len(x)) == g), replace(found.widths, noise=start)


def _backward_eliminated(search: _Search, found: _Set) -> _Set:
    """Groups dropped, cheapest first, the others taking over by the curvature, while one costs less than its price."""
    x, free, price = found.widths.noise**2 - search.noise.floor**2, found.free.copy(), search.price
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
    sizes = np.sqrt(search.noise.floor**2 + np.maximum(x, 0.0))
    return search.maximised_over(free, replace(found.widths, noise=np.where(free, sizes, found.widths.noise)))
