"""The printed model of one joint from its samples, its degree chosen: A, B and rho with their covariance."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from calibration.block_covariance import BlockCovariance, block_covariance
from calibration.joint_basis import basis_of, not_zero
from calibration.joint_model import JointModel, Quality, Terms, exponents
from calibration.joint_projection import RHO, Problem, Projection, limit_of, search
from calibration.joint_samples import Samples, box, pooled
from calibration.joint_selection import HIGHEST, Candidate


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
    """The choice "none"; terms that were zero throughout are still told."""
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
