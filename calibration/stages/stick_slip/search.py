"""Search for the stick-slip parameters: Gauss-Newton with Levenberg's damping, and scans of frictions and stiffnesses.

    step = -(H + l diag H)^-1 g,     H = sum_k H_k + S^-2,   g = sum_k g_k + S^-2 (p - p_0)

Whether a wheel slides in a jolt at all is a threshold: far from the right friction the cost has valleys of its own.
So a few steps are made from several starts, one of which hardly slips, and whenever the search ends, each friction and
each stiffness, which a wheel that slides at every turn shows little of, is tried at other values; it goes on from a
better one. So far the base is integrated in steps of 10 ms, a third of the work; from there on in those of 3.3 ms. Out
of valleys that no single parameter leads out of, two frictions changed at once do, or draws about the end, up to ten
times as wide as the information has it: a few steps from the best of these. Without them one matched robot in ten ends
far off, and front casters seem to slide where drives do.

The cost is rough: data that differ by single precision end half a standard deviation apart. So the last step is of

    z_i = (c(-1) - c(1)) / 2 / max(c(1) + c(-1) - 2 c(0), 2),    p = p_0 + H^-1/2 z,    c(+-1) at z_i = +-1

and none along an axis with a cliff on one side, whose information is that of the other one.

Where wheels are declared is not fitted, but looked for: of each wheel alone, by a step from the best point in the
parameters and its place, whose prior is PLACE wide. Right places seem off by up to 14 mm on robots of development,
mostly at a chi-square below 3; one that is wrong by 30 mm by 11 to 30, 45 of 48 above 3.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from calibration.stages.stick_slip.forcing import PlanarForcing
from calibration.stages.stick_slip.likelihood import DIFFERENCE, Trials, joined
from calibration.stages.stick_slip.measured import PlanarMotion
from calibration.stages.stick_slip.model import Direction
from calibration.stages.stick_slip.wheels import FORCE, HELD, NAMES

_LONGEST = 0.7  # step of a logarithm, at most
_DAMPING = 1e-2, 6.0, 1e-5, 1e5  # at the start, factor, least, most
_AT_ONCE = 4  # dampings that are tried: as fast as one
_GAIN = 0.5  # of the cost, below which a search ends
_CLIFF = 4.0  # rise of the cost within a standard deviation where a wheel begins to slide
_WIDER = np.repeat([1.0, 3.0, 10.0], 16)  # draws about an end, times their sigma
_VALLEY = 3.0  # by which the cost of another valley is less
_FIRST, _MOST = 2, 20  # steps of every start, and of the best
PLACE = 0.05  # [m] standard deviation of a wheel's declared place
_ELSEWHERE, _SHOWN = 0.009, 3.0  # [m] a wheel may seem off its place; chi-square of two degrees of freedom
_PLACE_STEP = 0.003  # [m] for derivatives
_SPREAD = (0.0, -0.5, 1.5)  # of the frictions' logarithms between starts: at the last one hardly a wheel slips
_SCAN = tuple(np.log([0.6, 0.8, 0.92, 1.15, 1.5]))
FRICTIONS = tuple(i for i, name in enumerate(NAMES) if name.endswith("_mu"))
_PAIRS = np.array([
    a * np.eye(len(NAMES))[i] + b * np.eye(len(NAMES))[j]
    for i, j in combinations(FRICTIONS, 2)
    for a, b in product(np.log([0.5, 0.7, 1.3, 1.6]), repeat=2)
])  # fmt: skip
_AS_FAST = 3  # of them side by side: as fast as one
_HOLDS = np.array([-3.0, -2.0, -1.2, -0.6, 0.6, 1.2, 2.0, 3.0])  # [N] of a drive
_HINT, _WORTH = 5.0, 12.0  # gain of the cost that is worth a search, and held forces; 7 where there are none
_SCANNED = (*FRICTIONS, *(i for i, name in enumerate(NAMES) if "_k" in name))


@dataclass(frozen=True)
class Point:
    """A point of a search.

    Attributes:
        logarithms: (p,).
        errors: See `Trials.errors`.
        cost: -2 log of the posterior.
        damping: Levenberg's.
        ended: Whether the last step gained next to nothing.
    """

    logarithms: np.ndarray
    errors: np.ndarray
    cost: float
    damping: float = _DAMPING[0]
    ended: bool = False


def searched(trials: Trials, rough: np.ndarray | None = None) -> Point:
    """The best point; from a rough one (p,), where one is known."""
    return shaken(trials, warmed(trials, sketched(trials)[0] if rough is None else rough))


def sketched(trials: Trials) -> tuple[np.ndarray, tuple[float, ...]]:
    """A rough point (p,), and the costs to which the starts came, in one step to a sample."""
    trials = trials.coarse
    frictions = np.array([float(i in FRICTIONS) for i in range(len(NAMES))])
    points = tried(trials, [trials.prior.mean + s * frictions for s in _SPREAD])
    for _ in range(_FIRST):
        points = [p if p.ended else stepped(trials, p) for p in points]
    best = descended(trials, scanned(trials, min(points, key=lambda p: p.cost)))
    return best.logarithms, tuple(p.cost for p in points)


def warmed(trials: Trials, start: np.ndarray) -> Point:
    """The best point from a start (p,) near it, as another source found it."""
    return descended(trials, scanned(trials, tried(trials, [start])[0]))


def settled(trials: Trials, best: Point) -> tuple[Point, tuple[np.ndarray, np.ndarray]]:
    """The bottom of the valley by costs a standard deviation to either side along each axis of z.

    And information (k, p, p) and gradient (k, p) of the trials there, by differences as wide.
    """
    H_k, _ = trials.normal(best.logarithms, best.errors)
    root = _root(trials, H_k)
    z, E = _around(trials, best, root)
    (new,) = tried(trials, [best.logarithms + np.clip(z, -1.0, 1.0) @ root])
    if new.cost <= best.cost + _GAIN:
        (H_k, _), best = trials.weighed(E, root, best.errors), new
        root = _root(trials, H_k)
        _, E = _around(trials, best, root)
    return best, trials.weighed(E, root, best.errors)


def _around(trials: Trials, at: Point, root: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """z (p,) of the least cost along each row of the root (p, p), and what one of z adds to the errors."""
    points = tried(trials, at.logarithms + np.concatenate([root, -root]))
    up, down = rises = np.reshape([p.cost - at.cost for p in points], (2, -1))
    above, below = np.reshape([p.errors - at.errors for p in points], (2, len(root), *at.errors.shape))
    low, high = rises.min(axis=0), rises.max(axis=0)
    cliff = (high > _CLIFF) & (low < 1.0)
    z = np.where(cliff, 0.0, (down - up) / 2.0 / np.maximum(up + down, 2.0))
    one_sided = np.where((up < down)[:, None, None, None], above, -below)
    return z, np.where(cliff[:, None, None, None], one_sided, 0.5 * (above - below))


def _root(trials: Trials, H_k: np.ndarray) -> np.ndarray:
    """H^-1/2 (p, p), symmetric: its axes do not depend on the order of like eigenvalues."""
    variances, axes = np.linalg.eigh(np.linalg.inv(H_k.sum(axis=0) + trials.prior.information))
    return np.asarray((axes * np.sqrt(variances)) @ axes.T)


def descended(trials: Trials, best: Point) -> Point:
    """Steps, and scans where they end, until neither gains."""
    for _ in range(_MOST):
        best = stepped(trials, best)
        if best.ended:
            best = scanned(trials, best)
            if best.ended:
                break
    return best


def shaken(trials: Trials, best: Point) -> Point:
    """The best point, or one of another valley, from draws about it."""
    rng, prior = np.random.Generator(np.random.PCG64(0)), trials.prior
    while True:
        H_k, _ = trials.normal(best.logarithms, best.errors)
        root = np.linalg.cholesky(np.linalg.inv(H_k.sum(axis=0) + prior.information))
        far = np.pad(rng.standard_normal((len(_WIDER), HELD.start)), ((0, 0), (0, len(NAMES) - HELD.start)))
        draws = _WIDER[:, None] * (far @ root.T)
        new = min(tried(trials, prior.bounded(best.logarithms + np.concatenate([draws, _PAIRS]))), key=lambda p: p.cost)
        for _ in range(_FIRST):
            new = stepped(trials, new)
        if new.cost > best.cost - _VALLEY:
            return best if best.cost < new.cost else new
        best = descended(trials, new)


def scanned(trials: Trials, at: Point) -> Point:
    """The point with another friction or stiffness, one after the other, where that gains more than a step's least."""
    best, left = at, _SCANNED
    while left:
        steps = np.multiply.outer(_SCAN, np.eye(len(NAMES))[list(left[:_AS_FAST])]).swapaxes(0, 1)
        points = tried(trials, best.logarithms + steps.reshape(-1, len(NAMES)))
        each = [min(points[i : i + len(_SCAN)], key=lambda p: p.cost) for i in range(0, len(points), len(_SCAN))]
        better = [i for i, p in enumerate(each) if p.cost < best.cost - _GAIN]
        best, left = (each[better[0]], left[better[0] + 1 :]) if better else (best, left[_AS_FAST:])
    return best


def tried(trials: Trials, logarithms: Sequence[np.ndarray] | np.ndarray) -> list[Point]:
    """Some starts."""
    errors = trials.errors(np.array(logarithms))
    return [Point(own, e, trials.cost(own, e)) for own, e in zip(logarithms, errors, strict=True)]


def stepped(trials: Trials, at: Point) -> Point:
    """One step on, or the same point, ended, where no step gains."""
    H_k, g_k = trials.normal(at.logarithms, at.errors)
    H = H_k.sum(axis=0) + trials.prior.information
    g = g_k.sum(axis=0) + trials.prior.information @ (at.logarithms - trials.prior.mean)
    _, factor, least, most = _DAMPING
    damping = at.damping
    while damping < most:
        dampings = damping * factor ** np.arange(_AT_ONCE)
        steps = [-np.linalg.solve(H + d * np.diag(np.diag(H)), g) for d in dampings]
        new = tried(trials, at.logarithms + np.clip(steps, -_LONGEST, _LONGEST))
        for p, d in zip(new, dampings, strict=True):
            if p.cost < at.cost:
                return replace(p, damping=max(d / factor, least), ended=at.cost - p.cost < _GAIN)
        damping = dampings[-1] * factor
    return replace(at, damping=damping, ended=True)


def holding(trials: Trials, best: Point) -> tuple[Trials, Point]:
    """What wheels hold where trials begin as parameters, too, where they are much likelier with it; else as it was."""
    free = replace(trials, prior=trials.prior.holding)
    at = np.repeat(best.logarithms[None], len(_HOLDS), axis=0)
    at[:, HELD] = _HOLDS[:, None] * [1.0, 0.0] / FORCE
    found = min(tried(free, at), key=lambda p: p.cost)
    if found.cost < best.cost - _HINT:
        found = descended(free, found)
    return (free, found) if found.cost < best.cost - _WORTH else (trials, best)


def displaced(trials: Trials, best: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where each wheel is by the trials (m, 2) if all others are where they are declared [m, off its declared place].

    One step of Gauss-Newton from the best parameters (p,), in these and the place of one wheel; and (m,) chi-square of
    two degrees of freedom of that place.
    """
    n, m = len(best), len(trials.wheels.position)
    prior = np.concatenate([np.diag(trials.prior.information), np.full(2 * m, PLACE**-2)])
    (errors,) = trials.errors(best[None])
    weight = np.sqrt(trials.independent / np.maximum(trials.windows[2].sum(axis=1), 1))[:, None]
    weight = (weight / np.sqrt(trials.variances(errors)))[:, None, :]
    steps = np.repeat([DIFFERENCE, _PLACE_STEP], [n, 2 * m])
    change = np.diag(steps)
    places = trials.wheels.position + change[:, n:].reshape(-1, m, 2)
    moved = trials.errors(best + change[:, :n], places)
    A = np.array([((own - errors) / h * weight).ravel() for own, h in zip(moved, steps, strict=True)])
    H, g = A @ A.T + np.diag(prior), A @ (errors * weight).ravel()
    g[:n] += prior[:n] * (best - trials.prior.mean)
    shift, chi2 = np.empty((m, 2)), np.empty(m)
    for w in range(m):
        own = np.concatenate([np.arange(n), n + 2 * w + np.arange(2)])
        covariance = np.linalg.inv(H[np.ix_(own, own)])
        shift[w] = -(covariance @ g[own])[n:]
        chi2[w] = shift[w] @ np.linalg.solve(covariance[n:, n:], shift[w])
    return shift, chi2


def shifts_of_wheels(
    campaign: Trials, rows: Sequence[tuple[PlanarForcing, PlanarMotion]], fit: Direction
) -> tuple[np.ndarray, np.ndarray]:
    """Shifts (m, 2) [m] and chi-squares (m,) of wheels by the trials that are not wild.

    About the parameters of all trials and of these alone: the less significant one, as one of some trials is chance.
    """
    wild = fit.held_out.wild
    calm = joined(campaign.wheels, [row for row, far in zip(rows, wild, strict=True) if not far], campaign.prior)
    shift, chi2 = displaced(calm, fit.logarithms)
    if wild.any() and elsewhere(shift, chi2).any():
        other, own = displaced(calm, descended(calm, tried(calm, [fit.logarithms])[0]).logarithms)
        shift, chi2 = np.where((own < chi2)[:, None], other, shift), np.minimum(own, chi2)
    return shift, chi2


def elsewhere(shift: np.ndarray, chi2: np.ndarray) -> np.ndarray:
    """Whether wheels (m,) seem off their declared places, by shifts (m, 2) [m] and chi-squares (m,)."""
    return np.asarray((np.abs(shift).max(axis=1) > _ELSEWHERE) & (chi2 > _SHOWN))
