"""How far the predicted motion of the base can be known: a band that grows with what slips.

    x(t) = mean_e x_e(t),     V_a(t) = s_a^2 + r_a^2 var_e x_e,a(t) + p_a^2 var_o x_o,a(t) + l_a L_a(t)
    L_a(t) = sum_(t' < t) share |dx_a|

x_e: predictions by an ensemble of parameters, from their posterior; x_o: by the optimum from wheels that are preloaded
at the start, about that without preload. L the path that the base went while wheels slid, by the share of them; l_a a
length: each slip adds an error of its own, independent of those before, that no parameter tells. s, r, p, l by maximum
likelihood on trials that were left out, then widened until the 95 % band holds 95 % of them.

Where the band is wider than the slip that is predicted, that prediction is worth nothing:

    x <- x_el + w (x - x_el),   w = max(0, 1 - (V - s^2) / max_(t' < t) (x - x_el)^2),   x_el = K_0^-1 F

x_el what springs alone would do under the force F: then no slip is predicted, and the band is no narrower.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from calibration.stages.stick_slip.likelihood import Trials
from calibration.stages.stick_slip.measured import blocks

MEMBERS = 16
_DRAWS = 32  # from which the members are chosen
_UNLIKELY = 26.2  # of -2 log of the posterior above its least: chi-square of 12, 99 %
_TWO_SIDED = 1.96
_INDEPENDENT = 100.0  # errors in trials that were left out
_LEAST = np.array([5e-6, 5e-6, 2e-5])  # [m, rad]: nothing is known better


@dataclass(frozen=True)
class Band:
    """The band of x, y, yaw.

    Attributes:
        floor: s (3,) [m, rad].
        spread: r (3,) [-].
        start: p (3,) [-].
        slip: l (3,) [m, rad].
    """

    floor: np.ndarray
    spread: np.ndarray
    start: np.ndarray
    slip: np.ndarray

    def variance(self, ensemble: np.ndarray, preloaded: np.ndarray, path: np.ndarray) -> np.ndarray:
        """V (n, 3) of the variances by parameters and by preload (n, 3) and the slid path (n, 3)."""
        return self.floor**2 + self.spread**2 * ensemble + self.start**2 * preloaded + self.slip * path


def ensemble_of(trials: Trials, logarithms: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Members (MEMBERS, p) of the posterior, the optimum first, then draws of the normal one that the data bear.

    A friction that never shows is known on one side only: draws on the other side, where it would show, are unlikely.
    Where most draws are, the least unlikely ones are taken.
    """
    rng = np.random.Generator(np.random.PCG64(len(trials.ids)))
    draws = rng.multivariate_normal(logarithms, covariance, size=_DRAWS, method="eigh")
    costs = np.array([trials.cost(d, trials.errors(d)) for d in draws])
    excess = costs - trials.cost(logarithms, trials.errors(logarithms))
    order = np.argsort(np.maximum(excess, _UNLIKELY), kind="stable")
    return np.concatenate([logarithms[None], draws[order[: MEMBERS - 1]]])


def slid_path(x: np.ndarray, share: np.ndarray) -> np.ndarray:
    """L (n, 3) of positions x (n, 3) and shares of wheels that slid (n,)."""
    steps = np.abs(np.diff(x, axis=0, prepend=x[:1]))
    return np.asarray(np.cumsum(share[:, None] * steps, axis=0))


@dataclass(frozen=True)
class LeftOut:
    """Blocks of trials that were left out, b of them.

    Attributes:
        errors: (b, 3) measured minus predicted, NaN where nothing was measured.
        ensemble: (b, 3) variance of the members.
        preloaded: (b, 3) variance by preload.
        path: (b, 3) that was slid.
        weight: (b,) of a block.
    """

    errors: np.ndarray
    ensemble: np.ndarray
    preloaded: np.ndarray
    path: np.ndarray
    weight: np.ndarray


def fitted_band(rows: LeftOut, noise: np.ndarray) -> Band:
    """The band by trials that were left out; noise (3,) of a block."""
    return Band(*np.array([_axis(rows, a, float(noise[a] ** 2), float(_LEAST[a])) for a in range(3)]).T)


def _axis(rows: LeftOut, a: int, noise: float, least: float) -> np.ndarray:
    """s, r, p, l of one axis."""
    seen = np.isfinite(rows.errors[:, a])
    e2, weight = rows.errors[seen, a] ** 2, rows.weight[seen] / rows.weight[seen].sum()
    size, path = max(float(np.median(e2)), least**2), rows.path[seen, a]
    parts = np.stack([np.ones(len(e2)), rows.ensemble[seen, a], rows.preloaded[seen, a], path])
    powers = np.array([2.0, 2.0, 2.0, 1.0])

    def variance(p: np.ndarray) -> np.ndarray:
        return np.asarray(noise + np.exp(powers * p) @ parts)

    def cost(p: np.ndarray) -> float:
        V = variance(p)
        prior = ((p - start) / (3.0, 1.0, 0.3, 3.0)) ** 2
        return float(weight @ (np.log(V) + e2 / V) + prior.sum() / _INDEPENDENT)

    start = np.log([np.sqrt(size), 1.0, 1.0, 0.1 * size / max(float(path.mean()), least)])
    p = minimize(cost, start, method="Nelder-Mead", options={"maxiter": 400}).x
    widened = float(np.quantile(e2 / variance(p), 0.95, weights=weight, method="inverted_cdf")) / _TWO_SIDED**2
    factor = max(widened, 1.0)
    return np.maximum(np.exp(p) * factor ** (1.0 / powers), [least, 1.0, 0.0, 0.0])  # r: no surer than the posterior


def block_means(trials: Trials, x: np.ndarray) -> np.ndarray:
    """Means (b, c) over blocks of x (n, c), trial by trial."""
    return np.concatenate([blocks(x[a:b]) for a, b in trials.spans])
