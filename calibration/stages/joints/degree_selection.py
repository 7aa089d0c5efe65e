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

from calibration.numerics.robust_covariance import BlockCovariance, block_covariance
from calibration.options import Terms
from calibration.stages.joints.model import Basis, Exponent, JointModel, Quality, basis_of, exponents, not_zero
from calibration.stages.joints.samples import Samples, box, pooled
from calibration.stages.joints.separable_fit import RANK, RHO, Problem, Projection, limit_of, rho_grid, search

HIGHEST = 5
_WORTH = 0.95  # a model that leaves more than this share of the mean square is not worth its coefficients [-]
_CLEAR = 1e3 * RANK  # least over largest of R's diagonal, above which columns are clearly of full rank [-]
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
    factors = [_factors(basis, s) for s in samples]
    new = (d for d, powers in enumerate(sets) if powers and (d == 0 or powers != sets[d - 1]))
    degrees = [d for d in new if _is_fixed(basis, sets[d], factors)]
    order = list(dict.fromkeys(c for d in degrees for c in _columns(basis, sets[d])))  # those of lower degrees first
    by_rho = [_of_others([F[:, [*order, -1]] for F in of_rho]) for of_rho in zip(*factors, strict=True)]
    folds = [
        _left_out(basis, [sets[d] for d in degrees], samples, order, k, of_others)
        for k, of_others in enumerate(zip(*by_rho, strict=True))
    ]
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


def _factors(basis: Basis, samples: Samples) -> list[np.ndarray]:
    """R of the QR of [M, y], (at most 2 k + 1, 2 k + 1), at every rho."""
    problem = Problem(basis(samples.theta, samples.tau), samples.velocity, samples.y)
    designs = (np.column_stack([problem.design(rho), samples.y]) for rho in rho_grid())
    return [np.asarray(np.linalg.qr(M, mode="r")) for M in designs]


def _of_others(factors: Sequence[np.ndarray]) -> list[np.ndarray]:
    """R of all trials but one, for each, from those of every trial."""
    before = list(accumulate(factors, _joined, initial=factors[0][:0]))
    behind = list(accumulate(reversed(factors), _joined, initial=factors[0][:0]))[::-1]
    return [_joined(before[k], behind[k + 1]) for k in range(len(factors))]


def _joined(R: np.ndarray, other: np.ndarray) -> np.ndarray:
    """R of the QR of both."""
    return np.asarray(np.linalg.qr(np.vstack([R, other]), mode="r"))


def _left_out(
    basis: Basis,
    sets: Sequence[tuple[Exponent, ...]],
    samples: Sequence[Samples],
    order: Sequence[int],
    k: int,
    of_others: Sequence[np.ndarray],
) -> list[np.ndarray]:
    """Discrepancy (n,) of trial k by the models of the others, one for each set of powers.

    `of_others` are their R at every rho, columns of the design in `order`.
    """
    others = [t for t in range(len(samples)) if t != k]
    ends = [2 * len(powers) for powers in sets]
    best = [(np.inf, 0.0, np.zeros((0, 0)))] * len(sets)
    for rho, R in zip(rho_grid(), of_others, strict=True):
        best = [min(b, (_square(R, p), float(rho), R), key=lambda b: b[0]) for b, p in zip(best, ends, strict=True)]
    domain, s = box(pooled([samples[t] for t in others])), samples[k]
    whole = Problem(basis(np.clip(s.theta, *domain[0]), np.clip(s.tau, *domain[1])), s.velocity, s.y)
    return [whole.design(rho)[:, order[:p]] @ _solution(R, p) for p, (_, rho, R) in zip(ends, best, strict=True)]


def _square(R: np.ndarray, p: int) -> float:
    """Least |M x - y|^2 of p columns M, by triangular [M, ..., y]."""
    size = np.abs(R.diagonal()[:p])
    if len(R) > p and size.min(initial=np.inf) > _CLEAR * size.max(initial=0.0):
        return float((R[p:, -1] ** 2).sum())
    return float(((R[:, -1] - R[:, :p] @ _solution(R, p)) ** 2).sum())


def _solution(R: np.ndarray, p: int) -> np.ndarray:
    """The least x of M x = y in least squares, of p columns M in triangular [M, ..., y]."""
    return np.asarray(np.linalg.lstsq(R[:p, :p], R[:p, -1], rcond=RANK)[0])


def fit_joint(joint: str, samples: Sequence[Samples], zero: float, terms: Terms, chosen: Candidate) -> JointModel:
    """The model of a joint with a degree that was chosen; "none" where the samples do not fix its coefficients."""
    none = no_correction(joint, samples, zero, terms)
    if chosen.degree is None:
        return none
    whole, powers, k = pooled(samples), chosen.powers, len(chosen.powers)
    basis = basis_of(powers, box(whole))
    problem = Problem(basis(whole.theta, whole.tau), whole.velocity, whole.y)
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
