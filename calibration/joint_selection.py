"""The degree of a joint model, by leaving one trial out.

    score = sum_trials |y_t - model fitted to the other trials (x_t)|^2 / sum_trials |y_t|^2

Each left-out trial is asked inside the others' domain, rho is theirs too. One QR per trial and rho serves all folds
and degrees: R_t' R_t = [M_t, y_t]' [M_t, y_t], and the lower degrees are columns of the highest one.
The lowest degree whose score is within a tenth of the best is taken: what a higher one gains on a handful of trials
does not carry over. The choice "none" scores 1 and stays unless a degree does clearly better.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from calibration.joint_basis import Basis, basis_of, not_zero
from calibration.joint_model import Exponent, Terms, exponents
from calibration.joint_projection import Problem, rho_grid
from calibration.joint_samples import Samples, box, pooled

HIGHEST = 5
_WORTH = 0.95  # a model that leaves more than this share of the mean square is not worth its coefficients [-]
_TIE = 1.1  # scores within this factor of the best are as good [-]


@dataclass(frozen=True)
class Candidate:
    """One degree of one joint, judged.

    Attributes:
        degree: None, without powers, is the choice "none".
        powers: Exponents of its terms that are not zero throughout.
        left_out: Predicted discrepancy of each trial by the model of the others [rad].
        score: Share of the mean square it leaves on left-out trials [-].
    """

    degree: int | None
    powers: tuple[Exponent, ...]
    left_out: tuple[np.ndarray, ...]
    score: float


def candidates(samples: Sequence[Samples], terms: Terms, highest: int = HIGHEST) -> tuple[Candidate, ...]:
    """The choice "none" and every degree up to the highest, judged on these trials."""
    whole = pooled(samples)
    found = [Candidate(None, (), tuple(np.zeros(len(s)) for s in samples), 1.0)]
    kept = not_zero(exponents(terms, highest), whole.theta, whole.tau)
    total = float((whole.y**2).sum())
    if not kept or len(samples) < 2 or total == 0.0:
        return tuple(found)
    basis = basis_of(kept, box(whole))
    factors = {float(rho): [_factor(basis, s, rho) for s in samples] for rho in rho_grid()}
    for degree in range(highest + 1):
        powers = tuple(p for p in exponents(terms, degree) if p in kept)
        if powers and powers != found[-1].powers:
            left_out = tuple(_left_out(basis, powers, samples, factors, k) for k in range(len(samples)))
            missed = sum(float(((s.y - p) ** 2).sum()) for s, p in zip(samples, left_out, strict=True))
            found.append(Candidate(degree, powers, left_out, missed / total))
    return tuple(found)


def choose(found: Sequence[Candidate]) -> Candidate:
    """The lowest degree nearly as good as the best; "none", which comes first, unless that is clearly better."""
    best = min(c.score for c in found)
    return next(c for c in found[1:] if c.score <= _TIE * best) if best < _WORTH else found[0]


def _factor(basis: Basis, samples: Samples, rho: float) -> np.ndarray:
    """R of the QR of [M, y], (at most 2 k + 1, 2 k + 1)."""
    M = Problem(basis(samples.theta, samples.tau), samples.velocity, samples.y).design(rho)
    return np.asarray(np.linalg.qr(np.column_stack([M, samples.y]), mode="r"))


def _left_out(
    basis: Basis, powers: tuple[Exponent, ...], samples: Sequence[Samples], factors: dict[float, list], k: int
) -> np.ndarray:
    """Discrepancy (n,) of trial k predicted by the model of the others."""
    which = [basis.powers.index(p) for p in powers]
    columns = which + [len(basis.powers) + w for w in which]
    best, x_best, rho_best = np.inf, np.zeros(len(columns)), 1.0
    for rho, R in factors.items():
        stacked = np.vstack([R_t for t, R_t in enumerate(R) if t != k])
        x = np.linalg.lstsq(stacked[:, columns], stacked[:, -1], rcond=1e-7)[0]
        cost = float(((stacked[:, -1] - stacked[:, columns] @ x) ** 2).sum())
        if cost < best:
            best, x_best, rho_best = cost, x, rho
    domain = box(pooled([s for t, s in enumerate(samples) if t != k]))
    s, n = samples[k], len(which)
    phi = basis(np.clip(s.theta, *domain[0]), np.clip(s.tau, *domain[1]))[:, which]
    S = expit(rho_best * s.velocity)
    return S * (phi @ x_best[:n]) + (1.0 - S) * (phi @ x_best[n:])
