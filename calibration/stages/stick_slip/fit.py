"""Estimation of the stick-slip base in its direction of use: from a wrench to the base's motion, one fit a source.

    covariance = H^-1 (c sum_k H_k + S^-2) H^-1,     H = sum_k H_k + S^-2,     p_(-k) = p + (H - H_k)^-1 g_k
    c = n / (n - 1) sum_k g_k' A_k g_k / sum_k tr(A_k H_k),     A_k = (H_k + S^-2 / n)^-1

H_k the information of trial k of n, g_k its gradient at the optimum, S the prior's. How long errors hang together is
assumed by the likelihood; c is by how much trials scatter over what that has them scatter (a sandwich of one scale: n
gradients do not show p x p numbers). p_(-k), the parameters without trial k, is a step of Gauss-Newton from there. The
motion predicted with them says what the model is worth on an axis of the floor's plane, and how wide its band is.
Reference: White, Econometrica 1982.

A wheel that all but slides bounds its friction on one side: the optimum is where sliding starts, and its curvature is
that of the other side. So a friction's sigma is at least half of how far it may go, alone, before the cost rises by 4.
"""

from dataclasses import dataclass, replace

import numpy as np

from calibration.stages.stick_slip.band import Band, LeftOut, block_means, ensemble_of, fitted_band, reached
from calibration.stages.stick_slip.kernel.bases import PLANE
from calibration.stages.stick_slip.likelihood import Trials
from calibration.stages.stick_slip.model import Direction
from calibration.stages.stick_slip.search import FRICTIONS, Point, settled, sketched, tried
from calibration.stages.stick_slip.wheels import SlipParameters, preloads
from calibration.stages.suspension.cross_validation import HeldOut
from calibration.stages.suspension.model import Source, Suspension

BETTER = 0.8  # mean square over another's, below which a prediction takes its place
_MOST = 0.5  # R2 of yaw above which springs may be all that moves the base
_RISE = 4.0  # of -2 log of the posterior: two standard deviations
_PARTS = (1.0, 0.5, 0.25)  # of a step without a trial
_REACH = np.array([0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.4])  # of a friction's logarithm


@dataclass(frozen=True)
class Fitted:
    """Parameters by one source of the wrench.

    Attributes:
        logarithms: (17,) see `wheels.NAMES`.
        covariance: (17, 17).
        others: (k, 17) without each of the trials.
        cost: -2 log of the posterior.
    """

    logarithms: np.ndarray
    covariance: np.ndarray
    others: np.ndarray
    cost: float

    @property
    def parameters(self) -> SlipParameters:
        """The parameters themselves."""
        return SlipParameters.of(self.logarithms)


def fitted(trials: Trials, best: Point) -> Fitted:
    """The parameters that predict the trials best, about the end of a search."""
    best, (H_k, g_k) = settled(trials, best)
    prior = trials.prior.information
    H = H_k.sum(axis=0) + prior
    inverse = np.linalg.inv(H)
    covariance = inverse @ (_scatter(H_k, g_k, prior) * H_k.sum(axis=0) + prior) @ inverse
    own = np.diag(covariance)
    covariance += np.diag(np.maximum(_one_sided(trials, best) ** 2 - own, 0.0))
    steps = np.array([_without(H, H_k[k], g_k[k], trials.prior.sigma) for k in range(len(g_k))])
    return Fitted(best.logarithms, covariance, _others(trials, best, steps), best.cost)


def _scatter(H_k: np.ndarray, g_k: np.ndarray, prior: np.ndarray) -> float:
    """c, by information (n, p, p) and gradients (n, p) of the trials, and the prior's information (p, p)."""
    n = len(H_k)
    A_k = np.linalg.inv(H_k + prior / n)
    return float(n / (n - 1) * np.einsum("ki,kij,kj", g_k, A_k, g_k) / np.einsum("kij,kji", A_k, H_k))


def _one_sided(trials: Trials, best: Point) -> np.ndarray:
    """Standard deviations (17,) by the side on which a friction goes farther alone; 0 of all but frictions."""
    sigma, directions = np.zeros(len(best.logarithms)), np.eye(len(best.logarithms))[list(FRICTIONS)]
    steps = np.concatenate([-_REACH[1:], _REACH[1:]])
    points = tried(trials, best.logarithms + np.concatenate([np.outer(steps, axis) for axis in directions]))
    rises = np.reshape([p.cost - best.cost for p in points], (len(FRICTIONS), 2, len(_REACH) - 1))
    rises = np.maximum.accumulate(np.pad(rises, ((0, 0), (0, 0), (1, 0))), axis=2)
    for i, sides in zip(FRICTIONS, rises, strict=True):
        sigma[i] = 0.5 * max(np.interp(_RISE, side, _REACH) for side in sides)
    return sigma


def _without(H: np.ndarray, H_k: np.ndarray, g_k: np.ndarray, longest: np.ndarray) -> np.ndarray:
    """Step of the logarithms when a trial is left out, none longer than its prior is wide."""
    return np.clip(np.linalg.solve(H - H_k, g_k), -longest, longest)


def _others(trials: Trials, best: Point, steps: np.ndarray) -> np.ndarray:
    """Parameters (k, 17) without each trial: as much of its step (k, 17) as the other trials bear best."""
    at = best.logarithms + np.multiply.outer([0.0, *_PARTS], steps)
    costs = np.empty(at.shape[:2])
    costs[0] = best.cost - trials.costs(best.errors)
    points = tried(trials, at[1:].reshape(-1, len(best.logarithms)))
    for i, p in enumerate(points):
        part, k = divmod(i, len(steps))
        costs[1 + part, k] = p.cost - trials.costs(p.errors)[k]
    return np.take_along_axis(at, costs.argmin(axis=0)[None, :, None], axis=0)[0]


def fit_direction(source: Source, trials: Trials, best: Point) -> Direction:
    """Parameters, ensemble, band and what trials say that were left out, about the end of a search by one source."""
    found = fitted(trials, best)
    ensemble = ensemble_of(trials, found.logarithms, found.covariance)
    members, _ = trials.simulated(ensemble)
    x = left_out(trials, found.others)
    preloaded = _preloaded(trials, found.parameters, members[0])
    spread = np.var(members, axis=0)
    slip = x - trials.force(source) @ np.linalg.inv(trials.wheels.stiffness(found.parameters))
    slipped = np.concatenate([reached(slip[a:b]) for a, b in trials.spans])
    error, seen = trials.measured - block_means(trials, x), np.concatenate([m.valid for m in trials.motions])
    masked = np.where(seen[:, None], error, np.nan)
    less_certain = spread + (members[0] - x) ** 2
    means = (_over_trials(trials, block_means(trials, v)) for v in (less_certain, preloaded, slipped))
    parts = LeftOut(_over_trials(trials, masked**2), *means)
    band = fitted_band(parts, trials.noise, trials.loads, trials.corrected)
    held_out = _held_out(trials, masked)
    return Direction(
        source,
        found.logarithms,
        found.covariance,
        ensemble,
        band,
        held_out,
        by_plate=trials.corrected or source != "plate",
    )


def rough_direction(source: Source, trials: Trials) -> Direction:
    """Parameters by a shorter search, without their covariance or a band; judged by the trials they are fitted to."""
    best, _ = sketched(trials)
    (x,), _ = trials.simulated(best[None])
    seen = np.concatenate([m.valid for m in trials.motions])
    error = np.where(seen[:, None], trials.measured - block_means(trials, x), np.nan)
    p, held_out = len(best), _held_out(trials, error)
    return Direction(
        source,
        best,
        np.zeros((p, p)),
        best[None],
        Band(*np.zeros((4, 3))),
        held_out,
        by_plate=trials.corrected or source != "plate",
    )


def linear_where(direction: Direction, suspension: Suspension) -> Direction:
    """The direction, linear where no wheel slides: on the axes that the compliance moves.

    No wheel slides where, on trials left out, the compliance explains most of yaw and leaves less than slip of x, y and
    yaw together (geometric mean of what is left, noise taken off). A valley of the fit may explain one axis by slip of
    a base that is anchored; x and y, moved by the same wheels, and trials in which it predicts a slip then speak
    against it. A trial that turns the base farther than all others together, which is hard to predict from those,
    speaks as much as they do, and no more.
    """
    springs, slip = dict(suspension.held_out).get(direction.source), direction.held_out
    if springs is None or springs.r2[PLANE[2]] < _MOST:
        return direction
    far, others = slip.farthest(2)
    parts = (slip,) if others is None else (slip.only(np.arange(len(slip.count)) == far), others)
    slides = np.mean([_excess(part, springs) for part in parts]) < -np.log(BETTER)
    return direction if slides else replace(direction, linear=springs.moves[list(PLANE)])


def _excess(slip: HeldOut, springs: HeldOut) -> float:
    """Logarithm of what slip leaves of trials over what springs do, mean of x, y, yaw.

    Of a trial after which the base rested elsewhere, which springs were not tried on, they explain nothing.
    """
    seen, elsewhere = springs.only(np.isin(springs.ids, slip.ids)), slip.only(~np.isin(slip.ids, springs.ids))
    axes, share = np.ones(6, dtype=bool), elsewhere.count.sum() / slip.count.sum()
    left = (1.0 - share) * seen.variance(axes)[list(PLANE)] + share * elsewhere.variance(~axes[: len(PLANE)])
    return float(np.log(slip.variance(axes[: len(PLANE)]) / left).mean())


def _over_trials(trials: Trials, x: np.ndarray) -> np.ndarray:
    """Means (k, 3) over the blocks (b, 3) of each trial that are not NaN."""
    ends = np.cumsum([len(m.valid) for m in trials.motions])[:-1]
    return np.array([np.nanmean(part, axis=0) if np.isfinite(part).any() else part[0] for part in np.split(x, ends)])


def _preloaded(trials: Trials, p: SlipParameters, x: np.ndarray) -> np.ndarray:
    """Mean square (n, 3) of what preloaded wheels change of positions x (n, 3)."""
    starts = preloads(trials.wheels, p, trials.loads[0])
    moved, _ = trials.simulated(np.repeat(p.logarithms[None], len(starts), axis=0), starts)
    return np.asarray(np.mean(np.square(moved - x), axis=0))


def left_out(trials: Trials, others: np.ndarray) -> np.ndarray:
    """Positions (n, 3) of each trial by the parameters (k, 17) of the others."""
    return np.concatenate([trials.alone(k).simulated(own[None])[0][0] for k, own in enumerate(others)])


def _held_out(trials: Trials, errors: np.ndarray) -> HeldOut:
    """Sums over trials of errors (b, 3), which are NaN where there is no marker."""
    rows, before = [], 0
    for motion in trials.motions:
        own = slice(before, before + len(motion.valid))
        e, x, before = errors[own][motion.valid], motion.x[motion.valid], own.stop
        rows.append(((e**2).sum(axis=0), (x**2).sum(axis=0), len(e) * motion.noise**2, len(e)))
    error, moved, noise, count = (np.array(a, dtype=float) for a in zip(*rows, strict=True))
    return HeldOut(error, moved, noise, count, trials.ids)
