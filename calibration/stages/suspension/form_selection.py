"""A fit of the base's springs, with what each trial left out would have changed; and why one must not be used."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.recording.schema import Description
from calibration.stages.suspension.base_response import BaseResponse
from calibration.stages.suspension.compliance_fit import fit_compliance
from calibration.stages.suspension.cross_validation import HeldOut
from calibration.stages.suspension.modal_response import modes_of
from calibration.stages.suspension.model import AXES
from calibration.stages.suspension.wheels import (
    WheelModel,
    bound,
    frame_sigma,
    jackknife,
    matrices,
    normal_of,
    solve,
    wheel_model,
)

_SETTLES = 1.0  # [s] a base takes less; a slower mode integrates the plate's noise into drift
_STIFF = 1e-5  # smallest eigenvalue of K over the largest, angles times the lever [-]
_LEVER = 0.2  # [m]
_WORSE = 0.02  # share of an axis' motion by which the printed form may predict worse than the compliance [-]


@dataclass(frozen=True)
class Springs:
    """A fit of either form.

    Attributes:
        K: (6, 6).
        C: (6, 6).
        folds: (K, C) without each trial.
        sigmas: Standard deviations of K and C.
        couples: (6, 6) elements that were fitted.
        wheels: The printed form, its values (2 p,) and those without each trial (n, 2 p); None for the compliance.
        bound: Of the printed form: the stiffness or damping that would be negative without its bound.
    """

    K: np.ndarray
    C: np.ndarray
    folds: tuple[tuple[np.ndarray, np.ndarray], ...]
    sigmas: tuple[np.ndarray, np.ndarray]
    couples: np.ndarray
    wheels: tuple[WheelModel, np.ndarray, np.ndarray] | None = None
    bound: str = ""


def printed_springs(description: Description, wheels: WheelModel, responses: Sequence[BaseResponse]) -> Springs:
    """The printed form, displacement to wrench."""
    normals = [normal_of(wheels, s, description.sigmas) for s in responses]
    values = solve(wheels, normals)
    others = np.array([solve(wheels, normals[:k] + normals[k + 1 :]) for k in range(len(normals))])
    folds = tuple(matrices(wheels, p) for p in others)
    K, C = matrices(wheels, values)
    sigmas = [np.sqrt(np.diag(jackknife(np.array([f[k].ravel() for f in folds])))).reshape(6, 6) for k in (0, 1)]
    placed = [np.hypot(s, frame_sigma(A, description.tolerances)) for s, A in zip(sigmas, (K, C), strict=True)]
    return Springs(
        K, C, folds, (placed[0], placed[1]), wheels.couples, (wheels, values, others), bound(wheels, normals, values)
    )


def compliance_springs(description: Description, responses: Sequence[BaseResponse]) -> Springs:
    """The reduced form, wrench to displacement."""
    couples = np.ones((6, 6), dtype=bool)
    if description.wheels:
        couples = wheel_model(description.wheels, "contact").couples
    found = fit_compliance(responses, couples)
    K, C = found.K, found.C
    placed = [np.hypot(s, frame_sigma(A, description.tolerances)) for s, A in zip(found.sigmas(), (K, C), strict=True)]
    return Springs(K, C, tuple(found.without(k) for k in range(len(responses))), (placed[0], placed[1]), couples)


def not_positive(springs: Springs) -> str:
    """Why a fit, or one without a trial, is at its bounds or cannot be integrated at all; empty where it can."""
    if springs.bound:
        return f"at its bound, {springs.bound} would be negative"
    scale = np.outer(*[np.array([1.0] * 3 + [1.0 / _LEVER] * 3)] * 2)
    for where, K in (("", springs.K), *((" without one of the trials", K) for K, _ in springs.folds)):
        stiffness = np.linalg.eigvalsh(K * scale)
        if stiffness[0] < _STIFF * stiffness[-1]:
            return f"its stiffness is not positive definite{where}"
    damping = np.linalg.eigvalsh(springs.C * scale)
    return "its damping is not positive" if damping[0] < -_STIFF * damping[-1] else ""


def refusal(springs: Springs, tried: HeldOut, reduced: HeldOut) -> str:
    """Why a positive printed fit must not be used, or nothing; `reduced` is the compliance on the same trials."""
    settling = modes_of(springs.K, springs.C, np.zeros((6, 6))).settling
    if settling > _SETTLES:
        return f"it drifts, its slowest mode takes {settling:.1f} s to settle"
    worse = _axes((tried.r2 < 0.0) & ~np.isnan(tried.explained))
    if worse:
        return f"integrated in time it predicts worse than a base at rest along {worse}"
    worse = _axes((tried.r2 < reduced.r2 - _WORSE) & ~np.isnan(tried.explained))
    if worse:
        return f"integrated in time it predicts worse than the compliance along {worse}"
    return ""


def _axes(which: np.ndarray) -> str:
    return ", ".join(a for a, w in zip(AXES, which, strict=True) if w)
