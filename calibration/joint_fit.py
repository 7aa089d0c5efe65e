"""Stage `joints`: the printed joint model of every joint that has a link encoder.

Data: motor minus link reading of all calibration trials, rests included, the mean over the static calibration postures
removed (the zero of readings). Inputs: motor encoders, the geometry's zeros, the nominal robot with its payload.
"""

import logging
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from calibration.clock import Clock
from calibration.errors import NotEnoughData
from calibration.hand import HandModel
from calibration.joint_basis import basis_of
from calibration.joint_correction import JointModels
from calibration.joint_inputs import input_model
from calibration.joint_model import JointModel, Quality, Terms, exponents
from calibration.joint_projection import Problem, clustered_covariance, search
from calibration.joint_samples import Samples, box, pooled, samples_of
from calibration.joint_selection import Candidate, candidates, choose
from calibration.joint_zero import link_zeros
from calibration.recording import Trial
from calibration.schema import Description
from calibration.verdict import Verdict

STAGE = "joints"
TERMS: Terms = "total"
_log = logging.getLogger(__name__)


def fit_joint_models(
    urdf: str, description: Description, trials: Sequence[Trial], robot: Clock, hand: HandModel, terms: Terms = TERMS
) -> tuple[JointModels, tuple[Verdict, ...]]:
    """The joint models, and what is to be said of them; without link encoders or rests, none.

    Args:
        urdf: Nominal robot.
        description: Of the dataset.
        trials: Calibration trials.
        robot: The robot's clock.
        hand: The calibrated geometry, whose zeros say what angle a reading means.
        terms: Which monomials a degree means.
    """
    inputs = input_model(urdf, description, hand)
    try:
        zero = link_zeros(trials, robot)
    except NotEnoughData as error:
        unknown = np.full(len(inputs.measured), np.nan)
        return JointModels(inputs, unknown, ()), (Verdict(STAGE, "missing", str(error)),)
    columns = list(zip(*(samples_of(inputs, trial, zero) for trial in trials), strict=True))
    found = {
        joint: fit_joint(joint, tuple(s for s in samples if s is not None), float(z), terms)
        for joint, samples, z in zip(inputs.measured, columns, zero, strict=True)
        if np.isfinite(z)
    }
    without = [joint for joint in hand.chain.joints if joint not in found]
    return JointModels(inputs, zero, tuple(found.values())), tuple(_verdicts(found.values(), without))


def fit_joint(joint: str, samples: Sequence[Samples], zero: float, terms: Terms = TERMS) -> JointModel:
    """The model of one joint from its samples, trial by trial; degree by leaving one trial out."""
    chosen = choose(candidates(samples, terms))
    fitted = fit_degree(joint, samples, zero, terms, chosen)
    _log.info("%s: degree %s of %s, rho %.0f", joint, fitted.degree, terms, fitted.rho)
    return fitted


def fit_degree(joint: str, samples: Sequence[Samples], zero: float, terms: Terms, chosen: Candidate) -> JointModel:
    """The model of one joint with a degree that was chosen."""
    whole = pooled(samples)
    domain, powers, k = box(whole), chosen.powers, len(chosen.powers)
    missed = np.concatenate([s.y - p for s, p in zip(samples, chosen.left_out, strict=True)])
    none = JointModel(joint, terms, None, (), (), 0.0, np.zeros(0), np.zeros(0), domain, zero)
    if chosen.degree is None:
        return replace(none, quality=_quality(whole.y, whole.y, missed))
    basis = basis_of(powers, domain)
    problem = Problem(basis(whole.theta, whole.tau), whole.velocity, whole.y)
    found = search(problem)
    J = np.column_stack([problem.design_slope(found.rho) @ found.x, problem.design(found.rho)])
    stops = np.cumsum([0, *(len(s) for s in samples)])
    groups = [slice(a, b) for a, b in pairwise(stops)]
    to_printed = np.eye(1 + 2 * k)
    to_printed[1 : 1 + k, 1 : 1 + k] = to_printed[1 + k :, 1 + k :] = basis.to_printed()
    values = to_printed @ np.append(found.rho, found.x)
    return replace(
        none,
        degree=chosen.degree,
        powers=powers,
        dropped=tuple(p for p in exponents(terms, chosen.degree) if p not in powers),
        rho=found.rho,
        A=values[1 : 1 + k],
        B=values[1 + k :],
        covariance=to_printed @ clustered_covariance(J, found.r, groups) @ to_printed.T,
        quality=_quality(whole.y, found.r, missed),
    )


def _quality(y: np.ndarray, residual: np.ndarray, left_out: np.ndarray) -> Quality:
    total = max(float(((y - y.mean()) ** 2).sum()), np.finfo(float).tiny)
    rms, left = (float(np.sqrt((x**2).mean())) for x in (y, residual))
    return Quality(rms, left, 1.0 - float(residual @ residual) / total, 1.0 - float(left_out @ left_out) / total)


def _verdicts(models: Iterable[JointModel], without: list[str]) -> Iterator[Verdict]:
    if without:
        yield Verdict(STAGE, "missing", f"no joint model, since there is no link encoder: {without}")
