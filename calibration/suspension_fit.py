"""Stage `suspension`: the base's springs from the base markers and the wrench on the floor, calibration trials alone.

    1  wrong data are told by name (suspension_checks)
    2  the printed form, displacement -> wrench; refused unless K > 0, C >= 0, it settles, and, run forward on trials it
       was not fitted to, it is on no axis worse than a base that stays
    3  refused: the reduced 6x6 compliance, fitted wrench -> displacement
    4  each axis is moved or left still, by leave-one-trial-out, for each source of the wrench

Where there is no plate the wrench is that of inverse dynamics.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.clock import Clock
from calibration.identifiability import Combination
from calibration.recording import Trial
from calibration.schema import Description
from calibration.suspension import AXES, Source, Suspension
from calibration.suspension_checks import STAGE, moved_bases, wrong_plate
from calibration.suspension_compliance import fit_compliance
from calibration.suspension_held_out import HeldOut, held_out
from calibration.suspension_modes import modes_of
from calibration.suspension_parameters import element_parameters, jackknife, wheel_parameters
from calibration.suspension_printed import matrices, normal_of, solve
from calibration.suspension_read import Laboratory, Sways, laboratory, read_sways
from calibration.suspension_sway import Sway
from calibration.suspension_wheels import Point, WheelModel, wheel_model
from calibration.verdict import Verdict

_SETTLES = 1.0  # [s] a base takes less; a slower mode integrates the plate's noise into drift
_STIFF = 1e-5  # smallest eigenvalue of K over the largest, angles times the lever [-]
_LEVER = 0.2  # [m]


@dataclass(frozen=True)
class Form:
    """What is fitted.

    Attributes:
        point: r_i of the printed form: `centre` of the hub or `contact`.
        full: Whether Kt, Ct, Ktheta, Ctheta are symmetric matrices instead of diagonal ones.
        coupled: Whether the compliance couples all six axes, as hub centres do, or (x, y, rz) and (z, rx, ry) apart,
            as contact points in the floor do.
    """

    point: Point = "centre"
    full: bool = False
    coupled: bool = False


@dataclass(frozen=True)
class Springs:
    """A fit of either form.

    Attributes:
        K: (6, 6).
        C: (6, 6).
        folds: (K, C) without each trial.
        sigmas: Standard deviations of K and C.
        couples: (6, 6) elements that were fitted.
        wheels: Values (2 p,) and those without each trial (n, 2 p); None for the compliance.
    """

    K: np.ndarray
    C: np.ndarray
    folds: tuple[tuple[np.ndarray, np.ndarray], ...]
    sigmas: tuple[np.ndarray, np.ndarray]
    couples: np.ndarray
    wheels: tuple[np.ndarray, np.ndarray] | None = None


def fit_suspension(
    urdf: str,
    description: Description,
    trials: Sequence[Trial],
    robot: Clock,
    plate: Clock | None,
    T_base_B: np.ndarray | None = None,
    form: Form | None = None,
) -> tuple[Suspension | None, tuple[Verdict, ...]]:
    """The suspension by calibration trials, None where there is none to be had, and what is to be said of it.

    T_base_B (4, 4) places the base's marker body on the base; nominal where it is not given.
    """
    lab = laboratory(urdf, description, robot, plate, T_base_B)
    sways = read_sways(lab, trials)
    found = list(wrong_plate(description, *sways.forcings)) if sways.plate else []
    moved = moved_bases(sways.dynamics)
    told = ", ".join(f"{name} by {how}" for name, how in moved.items())
    if moved:
        found.append(Verdict(STAGE, "warning", f"base moved during {told}: left out; brake it, or record again"))
    sways = sways.without(moved)
    if any(v.verdict == "refused" for v in found) or len(sways.dynamics) < 2:
        if len(sways.dynamics) < 2:
            found.append(
                Verdict(STAGE, "missing", "no suspension: it takes two trials that show the base and its load")
            )
        return None, tuple(found)
    if not sways.plate:
        found.append(Verdict(STAGE, "missing", "no force plate: springs fitted to the nominal inverse dynamics"))
    suspension, said = _fitted(lab, sways, form or Form())
    return suspension, (*found, *said)


def _fitted(lab: Laboratory, sways: Sways, form: Form) -> tuple[Suspension, list[Verdict]]:
    used = sways.plate or sways.dynamics
    wheels = wheel_model(lab.description.wheels, form.point, form.full) if lab.description.wheels else None
    refusal, springs = "no wheels declared", None
    if wheels is not None and sways.plate:
        springs = _printed(lab.description, wheels, used)
        refusal = _refusal(springs, held_out(used, springs.folds.__getitem__))
    said = []
    if springs is None or refusal:
        why = f"printed form (displacement to wrench) refused: {refusal}" if sways.plate else "no plate"
        said.append(
            Verdict(STAGE, "warning", f"{why}; the 6x6 compliance fitted wrench to displacement takes its place")
        )
        springs = _compliance(lab.description, used, form)
    sources: list[tuple[Source, tuple[Sway, ...]]] = [("plate", sways.plate), ("dynamics", sways.dynamics)]
    tried = tuple((s, held_out(rows, springs.folds.__getitem__)) for s, rows in sources if rows)
    parameters = (
        *element_parameters("K", springs.K, springs.sigmas[0], springs.couples, tried[0][1].explained),
        *element_parameters("C", springs.C, springs.sigmas[1], springs.couples, tried[0][1].explained),
    )
    combinations: tuple[Combination, ...] = ()
    if wheels is not None and springs.wheels is not None:
        more, combinations = wheel_parameters(wheels, *springs.wheels, len(parameters))
        parameters += more
    preload = np.mean([s.forcing.tangent for s in sways.plate], axis=0) if sways.plate else np.zeros((6, 6))
    suspension = Suspension(
        "compliance" if springs.wheels is None else "printed",
        springs.K,
        springs.C,
        *springs.sigmas,
        preload,
        np.mean([s.forcing.tangent for s in sways.dynamics], axis=0) - preload,
        tried,
        parameters,
        combinations,
    )
    return suspension, said + [_judged(s, h) for s, h in tried]


def _printed(description: Description, wheels: WheelModel, sways: Sequence[Sway]) -> Springs:
    normals = [normal_of(wheels, s, description.sigmas) for s in sways]
    values = solve(wheels, normals)
    others = np.array([solve(wheels, normals[:k] + normals[k + 1 :]) for k in range(len(normals))])
    folds = tuple(matrices(wheels, p) for p in others)
    sigma_K, sigma_C = (
        np.sqrt(np.diag(jackknife(np.array([f[k].ravel() for f in folds])))).reshape(6, 6) for k in (0, 1)
    )
    return Springs(*matrices(wheels, values), folds, (sigma_K, sigma_C), wheels.couples, (values, others))


def _compliance(description: Description, sways: Sequence[Sway], form: Form) -> Springs:
    couples = np.ones((6, 6), dtype=bool)
    if description.wheels and not form.coupled:
        couples = wheel_model(description.wheels, "contact").couples
    found = fit_compliance(sways, couples)
    folds = tuple(found.without(k) for k in range(len(sways)))
    return Springs(found.K, found.C, folds, found.sigmas(), couples)


def _refusal(springs: Springs, tried: HeldOut) -> str:
    """Why a printed fit must not be used; empty where it may."""
    scale = np.outer(*[np.array([1.0] * 3 + [1.0 / _LEVER] * 3)] * 2)
    stiffness, damping = np.linalg.eigvalsh(springs.K * scale), np.linalg.eigvalsh(springs.C * scale)
    if stiffness[0] < _STIFF * stiffness[-1]:
        return "its stiffness is not positive definite"
    if damping[0] < -_STIFF * damping[-1]:
        return "its damping is not positive"
    settling = modes_of(springs.K, springs.C, np.zeros((6, 6))).settling
    if settling > _SETTLES:
        return f"it drifts, its slowest mode takes {settling:.1f} s to settle"
    worse = [
        a for a, r2, share in zip(AXES, tried.r2, tried.explained, strict=True) if r2 < 0.0 and not np.isnan(share)
    ]
    if worse:
        return f"run forward it is worse than a base that stays along {', '.join(worse)}"
    return ""


def _judged(source: Source, tried: HeldOut) -> Verdict:
    """What the axes are worth."""
    told = ", ".join(f"{a} {r2:.2f}" for a, r2 in zip(AXES, np.maximum(tried.r2, -9.99), strict=True))
    still = [a for a, moves in zip(AXES, tried.moves, strict=True) if not moves]
    message = f"from {source}, left-out trials: R2 against a base that stays {told}"
    if still:
        message += f"; left still: {', '.join(still)} (they slip, or do not move visibly)"
    return Verdict(STAGE, "ok" if tried.moves[3:5].all() else "warning", message)
