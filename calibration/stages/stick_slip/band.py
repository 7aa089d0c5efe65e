"""How far the predicted motion of the base can be known: a band that grows with what slips.

    x(t) = mean_e x_e(t),     V_a(t) = s_a^2 + r_a^2 var_e x_e,a(t) + (p_a^2 + g^2) var_o x_o,a(t) + l_a^2 S_a(t)
    g^2 = OTHER^2 D^2 / (D^2 + FAR^2),  D = |m - m_usual|,  S_a(t) = max_(t' < t) (x - x_el)_a^2,  x_el = K_0^-1 F

x_e: predictions by an ensemble of parameters, from their posterior, mean and variance as a plate informs them in the
trial, see `kernel.informed`; x_o: by the optimum from wheels that are preloaded at the start, about that without
preload. m (My, -Mx) at the start: a base that begins under another load than most
trials came there by slips, which preload its wheels by up to OTHER of what they hold. x_el what springs alone would do
under the force F: S the largest slip so far, of which a share l_a [-] stays. Where a plate corrects the prediction it
tells how likely preloads are, tried up to c times the most, see `kernel.preloaded`:

    x = mean_e x_e + shift,   (p_a^2 + LEFT g^2 / c^2) mean_o (x_o - x_0)_a^2 + var_o,   c^2 = g^2 + TRIED^2

var_o by the weights, in the place of the preloads' part. An error stays once it is there, so a trial is one observation
of it,

    e_k^2 ~ V_k t_nu^2,   (log s, r, p, l) ~ N(PRIOR + u, WIDTH^2)             e_k rms of trial k when it was left out

u is 0 where wheels are what the model says. On other ground every error is larger: u is a multiple of log 2, common to
the axes, if trials find that likelier by SURE.

V is widened to the band's variance, (t / 1.96)^2 times by the 97.5 % quantile of n - 1 degrees of freedom of n trials.
A dozen trials do not identify four numbers: PRIOR is from new trials of 113 robots of development, 53 fixed, 46 sampled
and 14 after jolts: near the likeliest shares, scaled until 92 to 98 % of the hand's errors of each kind are inside,
without a plate once more by a fifth, on eight robots, as links and base move together.
A trial that is left out is predicted by parameters that are less certain: its own shift (x_k - x_(-k))^2 is added to
var_e.

Where the band is wider than the slip that is predicted, that prediction is worth nothing:

    x <- x_el + w (x - x_el),   w = max(0, 1 - (V - s^2) / S)

Then no slip is predicted, and the band is no narrower. An axis that the model does not move stays, or is linear, the
better the less the base is shaken: V = s^2 + r^2 max_(t' < t) x_el^2. Heave and tilt are linear, their band by what the
plate's compliance left of the markers' e_t, means of blocks whose noise is white, over all trials but the worst:

    r^2 = sum_t e_t e_(t+1) / sum_t max_(t' < t) h^2           not less than on robots of development
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import minimize
from scipy.special import ndtri, stdtrit

from calibration.numerics.compiled import njit
from calibration.stages.stick_slip.kernel.bases import FAR
from calibration.stages.stick_slip.kernel.preloaded import LEFT
from calibration.stages.stick_slip.likelihood import Trials
from calibration.stages.stick_slip.measured import blocks
from calibration.stages.stick_slip.wheels import DRIVES, HELD, NAMES

MEMBERS = 16
_DRAWS = 64  # from which the members are chosen
_NORMAL = ndtri((np.arange(MEMBERS - 1) + 0.5) / (MEMBERS - 1))  # as normal as so few are
_ROUGH = 4.0  # by which the cost varies between points next to each other: whether a wheel slides is a threshold
LEAST = np.array([5e-6, 3e-6, 15e-6])  # [m, rad]: nothing is known better
LEAST_HEAVE = np.array([[5e-6, 5e-6, 5e-6], [3.9e-2, 6.2e-3, 6.2e-3]])  # s [m, rad] and r [-] of z, rx, ry
_DEGREES = 6.0  # nu
_WIDER = 1.1  # variance of a plain band over V: what a trial in twenty shows beyond the spread of most
PRIOR = np.log(
    [
        [[11e-6, 0.7, 0.08, 1.4e-3], [3e-6, 0.57, 0.04, 2.2e-3], [16e-6, 0.48, 0.05, 1.7e-3]],
        [[16e-6, 2.1, 0.6, 10e-3], [11e-6, 2.2, 0.2, 5e-3], [110e-6, 1.9, 0.3, 5e-3]],
    ]
)  # s, r, p, l of x, y, yaw, where a plate corrects the prediction and where none does
WIDTH = np.array([0.5, 0.3, 0.4, 0.5])  # left-out `around_z` alone would make l as large as what it shows of frictions
SURE = 10.0  # by which -2 log of the likelihood falls; robots on the model's ground: 5 at most
_LARGER = np.log([1.0, 2.0, 4.0, 8.0, 16.0])  # u
TRIED = 0.1  # least share of preloads that is tried
_HIGHEST = 0.975  # share below the band's upper end
OTHER = 0.8  # [-] of the most that wheels can be preloaded, far from the usual load
_PLAIN, _PLAIN_WIDTH = 0.3, np.array([1.5, 1.5])  # r, and what the logarithms of s and r are uncertain by


@dataclass(frozen=True)
class Band:
    """The band of x, y, yaw.

    Attributes:
        floor: s (3,) [m, rad].
        spread: r (3,) [-].
        start: p (3,) [-].
        slip: l (3,) [-].
        usual: m_usual (2,) [N.m].
    """

    floor: np.ndarray
    spread: np.ndarray
    start: np.ndarray
    slip: np.ndarray
    usual: np.ndarray = field(default_factory=lambda: np.zeros(2))

    def begun(self, load: np.ndarray) -> "Band":
        """The band of a trial that begins under a load (3,) (-Fz, My, -Mx): p^2 + g^2 in the place of p^2."""
        return replace(self, start=np.sqrt(self.start**2 + other_start(load[1:], self.usual)))

    def judged(self, load: np.ndarray) -> tuple["Band", float]:
        """The same where a plate judges preloads, and how far those are tried, as a share of the most.

        p^2 + LEFT (g / share)^2 in the place of p^2: weights of few preloads are surer than they should be.
        """
        squared = other_start(load[1:], self.usual)
        most = squared + TRIED**2
        return replace(self, start=np.sqrt(self.start**2 + LEFT * squared / most)), float(np.sqrt(most))

    def variance(self, ensemble: np.ndarray, preloaded: np.ndarray, slipped: np.ndarray) -> np.ndarray:
        """V (n, 3) of the variances by parameters and by preload (n, 3) and the largest square of a slip (n, 3)."""
        return self.floor**2 + self.spread**2 * ensemble + self.start**2 * preloaded + self.slip**2 * slipped


def other_start(load: np.ndarray, usual: np.ndarray) -> np.ndarray:
    """g^2 of loads (..., 2) about the usual one (2,) [N.m]."""
    squared = ((load - usual) ** 2).sum(axis=-1)
    return np.asarray(OTHER**2 * squared / (squared + FAR**2))


@dataclass(frozen=True)
class PlainBand:
    """The band of three axes that the stick-slip model does not move.

    Attributes:
        floor: s (3,) [m, rad].
        growth: r (3,) [-].
    """

    floor: np.ndarray
    growth: np.ndarray

    def variance(self, reached: np.ndarray) -> np.ndarray:
        """V (n, 3) of `reached` of x_el (n, 3)."""
        return self.floor**2 + self.growth**2 * reached


def reached(x: np.ndarray) -> np.ndarray:
    """max_(t' < t) x^2 (n, 3) of x (n, 3)."""
    return np.asarray(np.maximum.accumulate(x**2, axis=0))


def plain_band(square: np.ndarray, reach: np.ndarray, noise: np.ndarray) -> PlainBand:
    """The band by mean squares (k, 3) of what trials left, and of `reached` in them; noise (3,) of a block."""
    ones = np.ones(len(square))
    found = []
    for a in range(3):
        start = np.log([max(float(noise[a]), LEAST[a]), _PLAIN])
        found.append(_fitted(square[:, a], np.stack([ones, reach[:, a]]), start, _PLAIN_WIDTH, float(noise[a] ** 2))[0])
    scale = np.sqrt(_WIDER)
    return PlainBand(*(scale * np.array(found)).T)


def heave_band(left: Sequence[np.ndarray], reach: Sequence[np.ndarray]) -> PlainBand:
    """The band of z, rx, ry by what successive blocks left (b, 3), NaN where not seen, and `reached` in them (b, 3)."""
    common, most = np.zeros((len(left), 3)), np.zeros((len(left), 3))
    for k, (e, h) in enumerate(zip(left, reach, strict=True)):
        e = e - np.nanmean(e, axis=0)
        steps = np.diff(e, axis=0)
        noise = 0.5 * np.nansum(steps**2, axis=0) / np.maximum(np.isfinite(steps).sum(axis=0), 1)
        common[k] = np.nansum(e[1:] * e[:-1], axis=0) + noise  # of which the mean took as much
        most[k] = np.where(np.isfinite(e), h, 0.0).sum(axis=0)
    worst, axes = common.argmax(axis=0), np.arange(3)
    common, most = (x.sum(axis=0) - x[worst, axes] for x in (common, most))
    growth = np.sqrt(np.maximum(common, 0.0) / np.maximum(most, np.finfo(float).tiny))
    return PlainBand(LEAST_HEAVE[0].copy(), np.maximum(growth, LEAST_HEAVE[1]))


def ensemble_of(trials: Trials, logarithms: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Members (MEMBERS, p) of the posterior, the optimum first, then draws of the normal one that the data bear.

    Such a draw costs no more than its distance squared and a little: a friction that never shows is known on one side
    only, and draws on the other side, where it would show, cost more. Where most do, those that least do are taken.
    The friction of the drives, of which the model is less certain than the data, varies by DRIVES in addition.
    """
    rng = np.random.Generator(np.random.PCG64(len(trials.ids)))
    variances, axes = np.linalg.eigh(covariance)
    far = np.hstack([rng.standard_normal((_DRAWS, n)) for n in (HELD.start, len(logarithms) - HELD.start)])
    root = (axes * np.sqrt(np.maximum(variances, 0.0))) @ axes.T  # symmetric: axes may change sign for next to nothing
    draws = logarithms + far @ root
    every = np.concatenate([draws, logarithms[None]])
    costs = np.array([trials.cost(p, e) for p, e in zip(every, trials.errors(every), strict=True)])
    excess = costs[:-1] - costs[-1] - (far**2).sum(axis=1)
    order = np.argsort(np.maximum(excess, _ROUGH), kind="stable")
    members = draws[order[: MEMBERS - 1]]
    members[:, NAMES.index("drive_mu")] += DRIVES * rng.permutation(_NORMAL)
    return np.concatenate([logarithms[None], members])


@dataclass(frozen=True)
class LeftOut:
    """Means over each trial that was left out, (k, 3).

    Attributes:
        square: Of what was measured less what was predicted.
        ensemble: Variance of the members.
        preloaded: Variance by preload.
        slipped: Largest square of a slip.
    """

    square: np.ndarray
    ensemble: np.ndarray
    preloaded: np.ndarray
    slipped: np.ndarray


def fitted_band(rows: LeftOut, noise: np.ndarray, loads: np.ndarray, corrected: bool = True) -> Band:
    """The band by trials that were left out.

    Args:
        rows: What they left.
        noise: (3,) of a block.
        loads: (k, 3) (-Fz, My, -Mx) under which they begin.
        corrected: Whether a plate corrects the prediction.
    """
    prior, usual = PRIOR[0 if corrected else 1], np.median(loads[:, 1:], axis=0)
    known = noise**2 + other_start(loads[:, 1:], usual)[:, None] * rows.preloaded
    tried = [[_axis(rows, a, prior[a] + u, known[:, a]) for a in range(3)] for u in _LARGER]
    costs = np.array([sum(cost for _, cost in axes) for axes in tried]) + np.where(_LARGER > 0.0, SURE, 0.0)
    found = np.array([factors for factors, _ in tried[costs.argmin()]])
    found *= stdtrit(max(len(loads) - 1, 1), _HIGHEST) / ndtri(_HIGHEST)
    return Band(np.maximum(found[:, 0], LEAST), found[:, 1], found[:, 2], found[:, 3], usual)


def _axis(rows: LeftOut, a: int, prior: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, float]:
    """s, r, p, l of one axis, beside a variance (k,) that is known, and their cost."""
    known = np.isfinite(rows.square[:, a])
    parts = np.stack([np.ones(len(rows.square)), *(v[:, a] for v in (rows.ensemble, rows.preloaded, rows.slipped))])
    return _fitted(rows.square[known, a], parts[:, known], prior, WIDTH, noise[known])


def _fitted(
    square: np.ndarray, parts: np.ndarray, prior: np.ndarray, width: np.ndarray, noise: np.ndarray | float
) -> tuple[np.ndarray, float]:
    """Factors (p,) of parts (p, k) by which squares (k,) are as likely as they can be, and -2 log of that."""

    def cost(p: np.ndarray) -> float:
        V = noise + np.exp(2.0 * p) @ parts
        tail = (_DEGREES + 1.0) * np.log1p(square / V / _DEGREES)
        return float((np.log(V) + tail).sum() + (((p - prior) / width) ** 2).sum())

    bounds = np.stack([prior - 4.0 * width, prior + 4.0 * width], axis=1)
    found = minimize(cost, prior, method="L-BFGS-B", bounds=bounds)
    return np.exp(found.x), float(found.fun)


def block_means(trials: Trials, x: np.ndarray) -> np.ndarray:
    """Means (b, c) over blocks of x (n, c), trial by trial."""
    return np.concatenate([blocks(x[a:b]) for a, b in trials.spans])


@njit(cache=True, error_model="numpy")
def banded(
    ensemble: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    before: np.ndarray,
    band: np.ndarray,
    elastic: np.ndarray,
    heave: np.ndarray,
    out: np.ndarray,
) -> None:
    """Band and believed motion of one sample: rows S, x, variance, largest squares of x_el and of heave and tilt.

    Args:
        ensemble: As of `advance_members`, (3,) each.
        before: (5, 3) as returned a sample ago.
        band: (4, 3) s, r, (p^2 + g^2)^1/2, l.
        elastic: (3,) what springs alone do.
        heave: (3,) z, rx, ry.
        out: (5, 3), filled.
    """
    moved, spread, preloaded, judged = ensemble
    for a in range(3):
        slip = moved[a] - elastic[a]
        largest = max(before[0, a], slip * slip)
        excess = band[1, a] ** 2 * spread[a] + band[2, a] ** 2 * preloaded[a] + band[3, a] ** 2 * largest + judged[a]
        kept = 1.0 - min(excess / largest, 1.0) if largest > 0.0 else 0.0
        out[0, a], out[1, a], out[2, a] = largest, elastic[a] + kept * slip, band[0, a] ** 2 + excess
        out[3, a] = max(before[3, a], elastic[a] * elastic[a])
        out[4, a] = max(before[4, a], heave[a] * heave[a])
