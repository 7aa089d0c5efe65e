"""The degrees of a joint model that predict a trial left out.

    score = sum_trials |y_t - model fitted to the other trials (x_t)|^2 / sum_trials |y_t|^2

Each left-out trial is asked inside the others' domain, rho is theirs too. One QR per trial and rho serves all folds
and degrees: R_t' R_t = [M_t, y_t]' [M_t, y_t], the lower degrees are columns of the highest one, and a fold joins the R
of all trials before its own with that of all behind. A degree whose coefficients the trials do not all fix is no
candidate: a joint that never moves shows both flanks at once, and neither. The choice "none" scores 1 and stays unless
a degree does clearly better.

The printed model of one joint from its samples, its degree chosen: A, B and rho with their covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise

import numpy as np
from scipy.linalg.lapack import dtpqrt

from calibration.numerics.robust_covariance import BlockCovariance, block_covariance
from calibration.options import Terms
from calibration.stages.joints.model import Basis, Exponent, JointModel, Quality, basis_of, exponents, not_zero
from calibration.stages.joints.samples import Samples, box, pooled
from calibration.stages.joints.separable_fit import (
    RANK,
    RHO,
    Problem,
    Projection,
    best_of_grid,
    limit_of,
    rho_grid,
    search,
    triangular,
)

HIGHEST = 5
_WORTH = 0.95  # a model that leaves more than this share of the mean square is not worth its coefficients [-]
_PANEL = 16  # columns of R that LAPACK turns at once
_TIE = 1.3  # scores within this factor of the best are as good: a handful of trials shows no difference [-]


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
    new = [d for d, powers in enumerate(sets) if powers and (d == 0 or powers != sets[d - 1])]
    order = list(dict.fromkeys(c for d in new for c in _columns(basis, sets[d])))  # those of lower degrees first
    rhos = rho_grid()
    middle = triangular(_problem(basis, whole), order, rhos[[len(rhos) // 2]])[0]
    degrees = [d for d in new if _is_fixed(middle, 2 * len(sets[d]))]
    ends = [2 * len(sets[d]) for d in degrees]
    order = order[: max(ends, default=0)]
    factors = [triangular(_problem(basis, s), order, rhos) for s in samples]
    of_others = np.array([_of_others(of_rho) for of_rho in zip(*factors, strict=True)]).swapaxes(0, 1)
    folds = [_left_out(basis, samples, order, ends, k, R) for k, R in enumerate(of_others)]
    for degree, left_out in zip(degrees, zip(*folds, strict=True), strict=True):
        missed = sum(float(((s.y - p) ** 2).sum()) for s, p in zip(samples, left_out, strict=True))
        found.append(Candidate(degree, sets[degree], left_out, missed / total))
    return tuple(found)


def worthwhile(found: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Degrees nearly as good as the best, lowest first; empty where "none" is no worse."""
    best = min(c.score for c in found)
    return tuple(c for c in found[1:] if c.score <= _TIE * best) if best < _WORTH else ()


def _problem(basis: Basis, samples: Samples) -> Problem:
    return Problem(basis(samples.theta, samples.tau), samples.velocity, samples.y)


def _is_fixed(R: np.ndarray, p: int) -> bool:
    """Whether all trials together, whose R this is, fix the coefficients of the first p columns."""
    s = np.linalg.svd(R[:p, :p], compute_uv=False)
    return bool(s[-1] > RANK * s[0])


def _columns(basis: Basis, powers: tuple[Exponent, ...]) -> list[int]:
    """Columns of the design that belong to powers, right flank then left."""
    own = [basis.powers.index(p) for p in powers]
    return own + [len(basis.powers) + c for c in own]


def _of_others(factors: Sequence[np.ndarray]) -> list[np.ndarray]:
    """R of all trials but one, for each, from those of every trial."""
    before = list(accumulate(factors[:-1], _joined))
    behind = list(accumulate(factors[:0:-1], _joined))[::-1]
    return [behind[0], *map(_joined, before[:-1], behind[1:]), before[-1]]


def _joined(R: np.ndarray, other: np.ndarray) -> np.ndarray:
    """R of the QR of both, which are triangular."""
    return np.asarray(dtpqrt(len(R), min(_PANEL, len(R)), R, other)[0])


def _left_out(
    basis: Basis, samples: Sequence[Samples], order: Sequence[int], ends: Sequence[int], k: int, of_others: np.ndarray
) -> list[np.ndarray]:
    """Discrepancy (n,) of trial k by the models of the others, each of the first columns in `order` up to an end.

    `of_others` are their R at every rho.
    """
    domain, s, rhos = box(pooled([*samples[:k], *samples[k + 1 :]])), samples[k], rho_grid()
    whole = _problem(basis, replace(s, theta=np.clip(s.theta, *domain[0]), tau=np.clip(s.tau, *domain[1])))
    best = [(p, *best_of_grid(of_others, p)) for p in ends]
    return [whole.design(float(rhos[i]))[:, order[:p]] @ x for p, i, x in best]


def fit_joint(joint: str, samples: Sequence[Samples], zero: float, terms: Terms, chosen: Candidate) -> JointModel:
    """The model of a joint with a degree that was chosen; "none" where the samples do not fix its coefficients."""
    none = no_correction(joint, samples, zero, terms)
    if chosen.degree is None:
        return none
    whole, powers, k = pooled(samples), chosen.powers, len(chosen.powers)
    basis = basis_of(powers, box(whole))
    problem = _problem(basis, whole)
    found = search(problem)
    if not found.full_rank:
        return none
    C, by_block = _covariance(problem, found, np.cumsum([0, *(len(s) for s in samples)]))
    to_printed = np.eye(1 + 2 * k)
    to_printed[1 : 1 + k, 1 : 1 + k] = to_printed[1 + k :, 1 + k :] = basis.to_printed()
    values = to_printed @ np.append(found.rho, found.x)
    missed = np.concatenate([s.y - p for s, p in zip(samples, chosen.left_out, strict=True)])
    return replace(
        none,
        degree=chosen.degree,
        powers=powers,
        dropped=tuple(p for p in exponents(terms, chosen.degree) if p not in powers),
        rho=found.rho,
        A=values[1 : 1 + k],
        B=values[1 + k :],
        covariance=to_printed @ C @ to_printed.T,
        blocks=by_block.blocks,
        quality=_quality(whole.y, found.r, missed),
    )


def _covariance(problem: Problem, found: Projection, stops: np.ndarray) -> tuple[np.ndarray, BlockCovariance]:
    """Covariance (1 + 2 k, 1 + 2 k) of rho, a, b, samples of a trial between two stops, and how it was found.

    At a limit of its search rho is no estimate: given, its variance that of a rho anywhere between the limits.
    """
    M, inside = problem.design(found.rho), limit_of(found.rho) is None
    J = np.column_stack([problem.design_slope(found.rho) @ found.x, M]) if inside else M
    trials = [slice(a, b) for a, b in pairwise(stops)]
    by_block = block_covariance([J[k, None] for k in trials], [found.r[k, None] for k in trials])
    if inside:
        return by_block.covariance, by_block
    C = np.zeros((1 + M.shape[1], 1 + M.shape[1]))
    C[0, 0] = (RHO[1] - RHO[0]) ** 2 / 12.0
    C[1:, 1:] = by_block.covariance
    return C, by_block


def no_correction(joint: str, samples: Sequence[Samples], zero: float, terms: Terms) -> JointModel:
    """The choice "none"; terms that were zero throughout are still reported."""
    whole, every = pooled(samples), exponents(terms, HIGHEST)
    kept = not_zero(every, whole.theta, whole.tau)
    rms = float(np.sqrt((whole.y**2).mean()))
    return JointModel(
        joint, terms, None, (), tuple(p for p in every if p not in kept), 0.0, np.zeros(0), np.zeros(0), box(whole),
        zero, quality=Quality(rms, rms),
    )  # fmt: skip


def _quality(y: np.ndarray, residual: np.ndarray, left_out: np.ndarray) -> Quality:
    total = max(float(((y - y.mean()) ** 2).sum()), np.finfo(float).tiny)
    rms, left = (float(np.sqrt((x**2).mean())) for x in (y, residual))
    return Quality(rms, left, 1.0 - float(residual @ residual) / total, 1.0 - float(left_out @ left_out) / total)
