"""Stage `suspension`: the base's springs from the base markers and the wrench on the floor, calibration trials alone.

    1  wrong data are named (checks.plates)
    2  the printed form, displacement -> wrench; refused unless K > 0, C >= 0, it settles, and, integrated on trials it
       was not fitted to, it is on no axis worse than a base that stays nor, by 2 % of the motion, than
    3  the reduced 6x6 compliance, fitted wrench -> displacement, which then takes its place
    4  each axis is predicted or taken at rest, by leave-one-trial-out, for each source of the wrench

Where there is no plate the wrench is that of inverse dynamics.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calibration.checks.plates import MASSES, SCALE, STAGE, moved_by, wrong_plate
from calibration.inference.parameters import Combination, Model
from calibration.numerics.signals import RATE
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.recording.trial import REST, Trial
from calibration.robot.laboratory import Laboratory
from calibration.stages.stage import Stage, StageInput, StageResult
from calibration.stages.suspension.base_response import BaseResponse, BaseResponses, WrenchSources, read_responses
from calibration.stages.suspension.cross_validation import HeldOut, held_out
from calibration.stages.suspension.form_selection import (
    Springs,
    compliance_springs,
    not_positive,
    printed_springs,
    refusal,
)
from calibration.stages.suspension.model import AXES, Source, Suspension
from calibration.stages.suspension.wheels import Point, element_parameters, wheel_model, wheel_parameters
from calibration.verdict import Verdict


def fit_suspension(
    lab: Laboratory,
    trials: Sequence[Trial],
    robot: Clock | None,
    plate: Clock | None,
    full: bool = False,
) -> tuple[Suspension | None, tuple[Verdict, ...]]:
    """The suspension by calibration trials, None where there is none to be had, and the verdicts on it.

    `full`: Kt, Ct, Ktheta, Ctheta of the printed form are symmetric matrices instead of diagonal ones.
    """
    if not sum(inertia.mass for inertia in lab.floating.inertias):
        return None, (Verdict(STAGE, "missing", "nominal.urdf has no masses, so no load is known: add its inertials"),)
    responses = read_responses(WrenchSources(lab, robot, plate, lab.T_base_B), trials)
    found = list(wrong_plate(lab, *responses.forcings)) if responses.plate else []
    moved = _moved_bases(responses.dynamics or responses.plate)
    listed = ", ".join(f"{name} by {how}" for name, how in moved.items())
    if moved:
        found.append(Verdict(STAGE, "warning", f"base moved during {listed}: left out; brake it, or record again"))
    responses = responses.without(moved)
    usable = len(responses.dynamics or responses.plate)
    if any(v.verdict == "refused" for v in found) or usable < 2:
        if usable < 2:
            found.append(
                Verdict(STAGE, "missing", "not estimated: it takes two trials that show the base and its load")
            )
        return None, tuple(found)
    if not responses.plate:
        found.append(Verdict(STAGE, "missing", "no force plate: springs fitted to the nominal inverse dynamics"))
    suspension, findings = _fitted(lab.description, responses, full)
    moved_by_plate = (with_springs_moved(v, lab.description, responses, suspension, full) for v in found)
    return suspension, (*moved_by_plate, *findings)


def with_springs_moved(
    found: Verdict, description: Description, responses: BaseResponses, suspension: Suspension, full: bool
) -> Verdict:
    """A finding of a plate off by an angle, with what it moved the springs by: fitted to its wrench turned back.

    A scale is that of every force, of forces or of torques: `checks.plates.by_scale`.
    """
    if not found.moves:
        return found
    (((what, size),),) = found.moves
    if what in (SCALE, MASSES):
        return found
    back = tuple(replace(r, forcing=r.forcing.turned(-size)) for r in responses.plate)
    other = {p.name: p.value for p in _fitted(description, replace(responses, plate=back), full)[0].parameters}
    return replace(found, moves=(tuple((p.name, p.value - other.get(p.name, p.value)) for p in suspension.parameters),))


def _moved_bases(responses: Sequence[BaseResponse]) -> dict[str, str]:
    """Trials after which the base rests elsewhere, and by how much."""
    after = {response.trial_id: moved_by(response.x[-int(0.5 * REST * RATE) :].mean(axis=0)) for response in responses}
    return {name: how for name, how in after.items() if how}


def _fitted(description: Description, responses: BaseResponses, full: bool) -> tuple[Suspension, list[Verdict]]:
    used = responses.plate or responses.dynamics
    springs = compliance_springs(description, used)
    findings = []
    if description.wheels and responses.plate:
        springs, verdict = _chosen(description, used, full, springs)
        findings.append(verdict)
    sources: list[tuple[Source, tuple[BaseResponse, ...]]] = [
        ("plate", responses.plate),
        ("dynamics", responses.dynamics),
    ]
    tried = tuple((s, held_out(rows, springs.folds.__getitem__)) for s, rows in sources if rows)
    slips = tried[0][1].slips
    parameters = (
        *element_parameters("K", springs.K, springs.sigmas[0], springs.couples, slips),
        *element_parameters("C", springs.C, springs.sigmas[1], springs.couples, slips),
    )
    combinations: tuple[Combination, ...] = ()
    if springs.wheels is not None:
        more, combinations = wheel_parameters(*springs.wheels, len(parameters))
        parameters += more
    preload = np.mean([s.forcing.tangent for s in responses.plate], axis=0) if responses.plate else np.zeros((6, 6))
    suspension = Suspension(
        "compliance" if springs.wheels is None else "printed",
        springs.K,
        springs.C,
        preload,
        np.mean([s.forcing.tangent for s in responses.dynamics], axis=0) - preload
        if responses.dynamics
        else np.zeros((6, 6)),
        tried,
        parameters,
        combinations,
    )
    return suspension, findings + [_judged(s, h) for s, h in tried]


def _chosen(
    description: Description, responses: Sequence[BaseResponse], full: bool, reduced: Springs
) -> tuple[Springs, Verdict]:
    """The printed form, about the points that predict better, or the reduced one where that is refused."""
    points: tuple[Point, ...] = ("centre", "contact")
    found: list[tuple[float, Springs, str, Point]] = []
    for point in points:
        springs = printed_springs(description, wheel_model(description.wheels, point, full), responses)
        why, worth = not_positive(springs), -np.inf
        if not why:
            tried = held_out(responses, springs.folds.__getitem__)
            why = refusal(springs, tried, held_out(responses, reduced.folds.__getitem__))
            worth = float(np.clip(tried.r2, -1.0, 1.0).sum())
        found.append((worth, springs, why, point))
    _, springs, why, point = max(found, key=lambda f: f[0])
    if not why:
        return springs, Verdict(
            STAGE, "ok", f"printed form with r_i the wheels' {point} points, displacement to wrench"
        )
    message = (
        f"the paper's form (springs at the wheels' {point} points) rejected: {why}; a 6x6 compliance fitted to the "
        "wrench is used instead"
    )
    return reduced, Verdict(STAGE, "warning", message)


def _judged(source: Source, tried: HeldOut) -> Verdict:
    """What the axes are worth."""
    listed = ", ".join(f"{a} {r2:.2f}" for a, r2 in zip(AXES, np.maximum(tried.r2, -9.99), strict=True))
    still = [a for a, moves in zip(AXES, tried.moves, strict=True) if not moves]
    message = f"from {source}, left-out trials: R2 against a base at rest {listed}"
    if still:
        message += f"; not predicted: {', '.join(still)} (they slip, or do not move visibly)"
    return Verdict(STAGE, "ok" if tried.moves[3:5].all() else "warning", message)


def suspension_model(suspension: Suspension) -> Model:
    """Row `model_1`: the suspension's parameters; what has no sigma is not known."""
    sigma = np.nan_to_num([p.sigma for p in suspension.parameters], nan=0.0)
    return Model("model_1", suspension.parameters, suspension.combinations, np.diag(sigma**2))


def _run(data: StageInput) -> StageResult:
    full = data.options.suspension == "full"
    found, findings = fit_suspension(data.lab, data.trials, data.clock("robot"), data.clock("plate"), full)
    return StageResult(() if found is None else (suspension_model(found),), findings, found)


def _lacks(data: StageInput) -> str:
    return "" if data.trials else "posture means show no motion; record base and plate continuously"


SUSPENSION = Stage(STAGE, _run, _lacks)
