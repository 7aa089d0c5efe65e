"""Stage `joints`: the printed joint model of every joint that has a link encoder.

Data: motor minus link reading of all calibration trials, rests included, the mean over the static calibration postures
removed (the zero of readings). Inputs: motor encoders, the geometry's zeros, the nominal robot with its payload.
Choices are judged by models that have not seen the trial they are judged on: which degrees are worth trying in the
joint's own discrepancy (`joint_selection`), which of them, if any, in the hand's error (`joint_hand`).

What stage `joints` says of the models it fitted.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.linalg import block_diag

from calibration.checks.joint_readings import wrong_links
from calibration.errors import NotEnoughData
from calibration.inference.parameters import Model, Parameter, Status
from calibration.numerics.robust_covariance import ENOUGH
from calibration.numerics.side_by_side import side_by_side
from calibration.options import Terms
from calibration.recording.clock import Clock
from calibration.recording.trial import Trial
from calibration.robot.hand import HandModel
from calibration.robot.laboratory import Laboratory
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.stages.joints.correction import InputModel, JointModels, input_model
from calibration.stages.joints.degree_selection import candidates, fit_joint, no_correction, worthwhile
from calibration.stages.joints.hand_selection import nearest_hand
from calibration.stages.joints.model import JointModel
from calibration.stages.joints.samples import Samples, link_zeros, pooled, samples_of
from calibration.stages.joints.separable_fit import RHO, limit_of
from calibration.stages.stage import Stage, StageInput, StageResult, has_postures
from calibration.verdict import Verdict

TERMS: Terms = "total"
_QUIET = 3.0  # rms of a discrepancy over the noise of a reading, below which there is nothing to model [-]
STAGE = "joints"


def fit_joint_models(
    lab: Laboratory, trials: Sequence[Trial], robot: Clock, hand: HandModel, terms: Terms = TERMS
) -> tuple[JointModels, tuple[Verdict, ...]]:
    """The joint models, and the verdicts on them; without link encoders or rests, none.

    Args:
        lab: Nominal robot and setup.
        trials: Calibration trials.
        robot: The robot's clock.
        hand: The calibrated geometry, whose zeros say what angle a reading means.
        terms: Which monomials a degree means.
    """
    inputs, description = input_model(lab, hand), lab.description
    try:
        zero = link_zeros(trials, robot)
    except NotEnoughData as error:
        unknown = np.full(len(inputs.measured), np.nan)
        return JointModels(inputs, unknown, ()), (Verdict(STAGE, "missing", str(error)),)
    refused = tuple(wrong_links(inputs.measured, trials, zero))
    if refused:
        return JointModels(inputs, zero, ()), refused
    samples = _samples(trials, inputs, hand, zero)
    quiet = [joint for joint, of_joint in samples.items() if _rms(of_joint) < _QUIET * description.sigmas.encoder]
    loud = {joint: of_joint for joint, of_joint in samples.items() if joint not in quiet}
    tried = dict(zip(loud, side_by_side(lambda of_joint: candidates(of_joint, terms), loud.values()), strict=True))
    options = {joint: worthwhile(found) for joint, found in tried.items()}
    chosen = nearest_hand(description, trials, robot, hand, samples, options)
    zeros = dict(zip(inputs.measured, map(float, zero), strict=True))
    models = [
        fit_joint(joint, of_joint, zeros[joint], terms, chosen[joint])
        if joint in chosen
        else no_correction(joint, of_joint, zeros[joint], terms)
        for joint, of_joint in samples.items()
    ]
    without = [joint for joint in hand.chain.joints if joint not in samples]
    worse = [joint for joint, found in options.items() if found and joint not in chosen]
    unexcited = [joint for joint, found in tried.items() if len(found) == 1]
    return JointModels(inputs, zero, tuple(models)), tuple(verdicts(models, worse, unexcited, quiet, without))


def _samples(
    trials: Sequence[Trial], inputs: InputModel, hand: HandModel, zero: np.ndarray
) -> dict[str, tuple[Samples, ...]]:
    """Samples of every joint of the chain with a link encoder, trial by trial, each with its own payload."""
    rows = [samples_of(inputs.of_trial(trial.id), trial, zero) for trial in trials]
    columns = dict(zip(inputs.measured, zip(*rows, strict=True), strict=True))
    found = {joint: tuple(s for s in columns[joint] if s is not None) for joint in hand.chain.joints}
    return {joint: of_joint for joint, of_joint in found.items() if of_joint}


def _rms(samples: Sequence[Samples]) -> float:
    return float(np.sqrt((pooled(samples).y ** 2).mean()))


def verdicts(
    models: Sequence[JointModel],
    worse: Sequence[str],
    unexcited: Sequence[str],
    quiet: Sequence[str],
    without: Sequence[str],
) -> Iterator[Verdict]:
    """What was fitted, and what not and why.

    Args:
        models: Of every joint with a link encoder.
        worse: Joints whose model would lead the hand away from its markers.
        unexcited: Joints whose trials fix the coefficients of no degree.
        quiet: Joints whose encoders differ by no more than noise.
        without: Joints without a link encoder.
    """
    if without:
        yield Verdict(STAGE, "missing", f"no joint model without a link encoder: {', '.join(without)}")
    used = [m for m in models if m.degree is not None]
    if used:
        yield Verdict(STAGE, "ok", f"{used[0].terms} terms; {'; '.join(_summary(m) for m in used)}")
        yield from _at_limits(used)
        yield from _few_blocks(used)
    if worse:
        yield Verdict(STAGE, "ok", f"not corrected, since the hand comes no nearer to its markers: {', '.join(worse)}")
    if unexcited:
        message = f"no two trials excite {', '.join(unexcited)}: record some that move them both ways under load"
        yield Verdict(STAGE, "missing", message)
    if quiet:
        yield Verdict(STAGE, "ok", f"not corrected, since both encoders agree within their noise: {', '.join(quiet)}")
    none = [m.joint for m in models if m.degree is None and m.joint not in (*worse, *unexcited, *quiet)]
    if none:
        yield Verdict(STAGE, "ok", f"not corrected, since no degree predicts a trial left out: {', '.join(none)}")
    for model in used:
        if model.dropped:
            names = ", ".join(f"A_{i}{j}, B_{i}{j}" for i, j in model.dropped)
            yield Verdict(STAGE, "ok", f"{model.joint}: terms that are zero throughout are left out: {names}")


def _at_limits(used: Sequence[JointModel]) -> Iterator[Verdict]:
    """What a search for rho that ended at a limit leaves open."""
    for limit, rho, meaning in (
        ("lowest", RHO[0], "the direction of motion hardly chooses a flank; no coefficient is identifiable"),
        (
            "highest",
            RHO[1],
            "the flanks change faster than the readings show; rho cannot be identified, both flanks can",
        ),
    ):
        found = [m.joint for m in used if limit_of(m.rho) == limit]
        if found:
            yield Verdict(
                STAGE, "warning", f"rho at its {limit} limit, {rho:g} s/rad, in {', '.join(found)}: {meaning}"
            )


def _few_blocks(used: Sequence[JointModel]) -> Iterator[Verdict]:
    """Whose uncertainty rests on few stretches of motion."""
    few = [m for m in used if 0 < m.blocks < ENOUGH]
    if few:
        message = (
            f"uncertainty of {', '.join(m.joint for m in few)} rests on {min(m.blocks for m in few)} stretches of "
        )
        message += f"motion that count as independent, fewer than {ENOUGH}: its intervals are wide; record longer"
        yield Verdict(STAGE, "ok", message)


def _summary(model: JointModel) -> str:
    q = model.quality
    limit = " (its limit)" if limit_of(model.rho) else ""
    return (
        f"{model.joint} degree {model.degree}, rho {model.rho:.3g} s/rad{limit}, {1e3 * q.rms:.1f} -> "
        f"{1e3 * q.residual:.1f} mrad, R2 {q.r2:.2f}, left out {q.r2_out:.2f}"
    )


def joints_model(geometry: Model, models: tuple[JointModel, ...]) -> Model:
    """Row `model_3`: the parameters of the geometry, then `sigmoid.<joint>.{rho,A_ij,B_ij}`."""
    added, blocks = [], [geometry.covariance]
    for model in models:
        values = (model.rho, *model.A, *model.B) if model.powers else ()
        names = ("rho", *(f"{side}_{i}{j}" for side in "AB" for i, j in model.powers))
        units = ("s/rad", *(f"rad/(rad^{i} (N.m)^{j})" for _ in "AB" for i, j in model.powers))
        covariance = model.covariance if model.powers else np.zeros((0, 0))
        sigma = np.sqrt(np.diag(covariance))
        added += [
            Parameter(f"sigmoid.{model.joint}.{n}", u, 0.0, float(v), float(s), _status(n, model.rho))
            for n, u, v, s in zip(names, units, values, sigma, strict=False)
        ]
        blocks.append(covariance)
    return Model(
        "model_3",
        (*geometry.parameters, *added),
        covariance=block_diag(*blocks),
        joints=geometry.joints,
        reading_sigma=geometry.reading_sigma,
    )


def _status(name: str, rho: float) -> Status:
    """At a limit of its search rho is where the search ended, and at the lowest no flank is separated."""
    limit = limit_of(rho)
    return "not_identifiable" if limit == "lowest" or (limit and name == "rho") else "estimated"


def _run(data: StageInput) -> StageResult:
    """Joint models beside the geometry; none where an earlier result was rejected."""
    geometry, robot = data.model("model_2"), data.clock("robot")
    if data.rejected or geometry is None:
        return StageResult()
    if robot is None:
        raise NotEnoughData("no robot clock")
    hand = hand_of(geometry, data.lab.chain, data.lab.nominal_frames)
    found, findings = fit_joint_models(data.lab, data.trials, robot, hand, data.options.terms)
    if not found.models:
        return StageResult(findings=findings)
    return StageResult((joints_model(geometry, found.models),), findings, found)


def _lacks(data: StageInput) -> str:
    if data.postures is not None and data.clock("robot") is None:
        return "posture means have no link encoders; record motor and link readings continuously"
    return has_postures(data)


JOINTS = Stage(STAGE, _run, _lacks, needs="geometry")
