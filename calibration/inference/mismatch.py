"""Whether the residuals of a fit depend on what its model leaves out: a family of tests, together at 1 %.

    b_g = N~_g' e_g,   N~ = M^1/2 N,   e = M^+1/2 r                   whitened; block g a motion, or one static posture
    M = 1 - J H^-1 J',   H = J'J + P                                  covariance of the residuals r
    T = b' V^+ b,      b = sum_g b_g,   V = sum_g c_g c_g',   c_g = N~_g' C_gg^-1/2 e_g,   C = M^+ M
    p = share of random signs of the c_g with a T as large            V does not change with them

N (n, d, m) are the directions of one effect, as of time, load or posture; what the parameters absorb of them is taken
out. e are the residuals brought back to the size of the errors before the fit. Where nothing is wrong those of a block
are as likely with either sign, however they hang together within it. An effect is seen where Holm's procedure rejects
at 1 % over the family. Its size at the hand is the root mean square displacement by its best directions. One that
hardly varies beside the parameters is not excited.
References: Holm, Scand. J. Statistics 1979; Cameron, Gelbach, Miller, Rev. Econ. Stat. 2008 (signs of blocks); Bell,
McCaffrey, Survey Methodology 2002 (C).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.inference.family import Shown, holm
from calibration.inference.map_estimate import Fit
from calibration.inference.parameters import ParameterSet

_SIGNS = 8_000
_SEED = 20261122  # of the signs alone: the same residuals have the same p
_LEFT = 1e-3  # [-] share of an effect's square that the parameters must leave for it to be excited
_ABSORBED = 1e-3  # [-] share of an error left by the fit below which nothing is known of it
_SINGULAR = 1e-14  # [-] share of the largest eigenvalue below which parameters are not determined
_BLOCKS = 1.5  # blocks a direction, at least


@dataclass(frozen=True)
class Effect:
    """Directions of what a model may leave out, by name: (n, d, m) as the residuals, by unit size."""

    name: str
    N: np.ndarray


def mismatch(fit: Fit, parameters: ParameterSet, effects: Sequence[Effect], block: np.ndarray) -> tuple[Shown, ...]:
    """Test every effect on the residuals of a fit; block (n,) numbers rows that hang together."""
    H = fit.J_white.T @ fit.J_white + np.diag(parameters.prior.precision(fit.widths.prior))
    value, V = np.linalg.eigh(H)
    known = value > _SINGULAR * value[-1]
    U, s, _ = np.linalg.svd(fit.J_white @ V[:, known] / np.sqrt(value[known]), full_matrices=False)
    rest, r = np.sqrt(np.maximum(1.0 - s**2, 0.0)), fit.r_white.ravel()
    left = rest > _ABSORBED
    errors = r + U @ ((np.where(left, 1.0 / np.where(left, rest, 1.0), 0.0) - 1.0) * (U.T @ r))
    number = np.unique(block, return_inverse=True)[1]
    single = _full_size(errors, U[:, ~left], np.repeat(number, len(r) // len(number)))
    found = []
    for effect in effects:
        N = (fit.whitener @ effect.N).reshape(len(r), -1)
        seen = N + U @ ((rest - 1.0)[:, None] * (U.T @ N))
        found.append(_tested(effect, N, seen, errors, single, number))
    return holm(found)


def _full_size(errors: np.ndarray, lost: np.ndarray, block: np.ndarray) -> np.ndarray:
    """C_gg^-1/2 e_g of every block of errors (k,), C = 1 - lost lost', without what a block does not show."""
    full = errors.copy()
    for g in range(int(block.max()) + 1 if lost.size else 0):
        own = block == g
        U, s, _ = np.linalg.svd(lost[own], full_matrices=False)
        rest = np.sqrt(np.maximum(1.0 - s**2, 0.0))
        shown = rest > _ABSORBED
        full[own] += U @ ((np.where(shown, 1.0 / np.where(shown, rest, 1.0), 0.0) - 1.0) * (U.T @ errors[own]))
    return full


def _tested(
    effect: Effect, N: np.ndarray, left: np.ndarray, errors: np.ndarray, single: np.ndarray, block: np.ndarray
) -> Shown:
    n = len(block)
    shown = (left**2).sum(axis=0) > _LEFT * (N**2).sum(axis=0)
    groups = int(block.max()) + 1
    if not shown.any() or groups < _BLOCKS * shown.sum():
        return Shown(effect.name, np.nan)
    left = left[:, shown]
    b = np.zeros((groups, left.shape[1]))
    np.add.at(b, block, (left * single[:, None]).reshape(n, -1, left.shape[1]).sum(axis=1))
    scale = np.sqrt((b**2).sum(axis=0))
    scaled = b / scale
    root = np.linalg.pinv(scaled.T @ scaled, rcond=1e-9, hermitian=True)
    signs = np.random.default_rng(_SEED).choice([-1.0, 1.0], size=(_SIGNS, groups))
    drawn, own = signs @ scaled, left.T @ errors / scale
    as_large = int((((drawn @ root) * drawn).sum(axis=1) >= own @ root @ own * (1.0 - 1e-12)).sum())
    size = np.linalg.lstsq(left, -errors, rcond=1e-6)[0]
    moved = effect.N[:, :3, shown] @ size
    return Shown(effect.name, (1 + as_large) / (1 + _SIGNS), size=float(np.sqrt((moved**2).sum(axis=1).mean())))
