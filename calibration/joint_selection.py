"""The degrees of a joint model that predict a trial left out.

    score = sum_trials |y_t - model fitted to the other trials (x_t)|^2 / sum_trials |y_t|^2

Each left-out trial is asked inside the others' domain, rho is theirs too. One QR per trial and rho serves all folds
and degrees: R_t' R_t = [M_t, y_t]' [M_t, y_t], and the lower degrees are columns of the highest one. A degree whose
coefficients the trials do not all fix is no candidate: a joint that never moves shows both flanks at once, and neither.
The choice "none" scores 1 and stays unless a degree does clearly better.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.joint_basis import Basis, basis_of, not_zero
from calibration.joint_model import Exponent, Terms, exponents
from calibration.joint_projection import RANK, Problem, rho_grid
from calibration.joint_samples import Samples, box, pooled

HIGHEST = 5
_WORTH = 0.95  # a model that leaves more than this share of the mean square is not worth its coefficients [-]
_TIE = 1.3  # scores within this factor of the best are as good: a handful of trials tells no better [-]


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
    sets = [tuple(p for p in exponents(terms, degree) if p in kept) for degree in range(highest + 1)]
    factors = [[_factor(basis, s, rho) for rho in rho_grid()] for s in samples]
    new = (d for d, powers in enumerate(sets) if powers and (d == 0 or powers != sets[d - 1]))
    degrees = [d for d in new if _is_fixed(basis, sets[d], factors)]
    folds = [_left_out(basis, [sets[d] for d in degrees], samples, factors, k) for k in range(len(samples))]
    for degree, left_out in zip(degrees, zip(*folds, strict=True), strict=True):
        missed = sum(float(((s.y - p) ** 2).sum()) for s, p in zip(samples, left_out, strict=True))
        found.append(Candidate(degree, sets[degree], left_out, missed / total))
    return tuple(found)


def worthwhile(found: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Degrees nearly as good as the best, lowest first; empty where "none" is no worse."""
    best = min(c.score for c in found)
    return tuple(c for c in found[1:] if c.score <= _TIE * best) if best < _WORTH else ()


def _is_fixed(basis: Basis, powers: tuple[Exponent, ...], factors: Sequence[Sequence[np.ndarray]]) -> bool:
    """Whether all trials together fix every coefficient, at the middle of the search for rho."""
    R = np.vstack([of_trial[len(of_trial) // 2] for of_trial in factors])
    s = np.linalg.svd(R[:, _columns(basis, powers)], compute_uv=False)
    return bool(s[-1] > RANK * s[0])


def _columns(basis: Basis, powers: tuple[Exponent, ...]) -> list[int]:
    """Columns of the design that belong to powers, right flank then left."""
    own = [basis.powers.index(p) for p in powers]
    return own + [len(basis.powers) + c for c in own]


def _factor(basis: Basis, samples: Samples, rho: float) -> np.ndarray:
    """R of the QR of [M, y], (at most 2 k + 1, 2 k + 1)."""
    M = Problem(basis(samples.theta, samples.tau), samples.velocity, samples.y).design(rho)
    return np.asarray(np.linalg.qr(np.column_stack([M, samples.y]), mode="r"))


def _left_out(
    basis: Basis,
    sets: Sequence[tuple[Exponent, ...]],
    samples: Sequence[Samples],
    factors: Sequence[Sequence[np.ndarray]],
    k: int,
) -> list[np.ndarray]:
    """Discrepancy (n,) of trial k by the models of the others, one for each set of powers."""
    others = [t for t in range(len(samples)) if t != k]
    best = [(np.inf, 0.0, np.zeros(0))] * len(sets)
    for rho, of_others in zip(rho_grid(), zip(*(factors[t] for t in others), strict=True), strict=True):
        R = np.asarray(np.linalg.qr(np.vstack(of_others), mode="r"))
        for which, powers in enumerate(sets):
            M = R[:, _columns(basis, powers)]
            x = np.linalg.lstsq(M, R[:, -1], rcond=RANK)[0]
            best[which] = min(best[which], (float(((R[:, -1] - M @ x) ** 2).sum()), float(rho), x), key=lambda b: b[0])
    domain, s = box(pooled([samples[t] for t in others])), samples[k]
    whole = Problem(basis(np.clip(s.theta, *domain[0]), np.clip(s.tau, *domain[1])), s.velocity, s.y)
    return [whole.design(rho)[:, _columns(basis, powers)] @ x for powers, (_, rho, x) in zip(sets, best, strict=True)]
