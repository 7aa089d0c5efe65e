"""Stage `joints`: the printed joint model of every joint that has a link encoder.

Data: motor minus link reading of all calibration trials, rests included, the mean over the static calibration postures
removed (the zero of readings). Inputs: motor encoders, the geometry's zeros, the nominal robot with its payload.
Choices are judged by models that have not seen the trial they are judged on: which degrees are worth trying in the
joint's own discrepancy (`joint_selection`), which of them, if any, in the hand's error (`joint_hand`).
"""

from collections.abc import Iterator, Sequence

import numpy as np

from calibration.clock import Clock
from calibration.errors import NotEnoughData
from calibration.hand import HandModel
from calibration.joint_correction import JointModels
from calibration.joint_hand import nearest_hand
from calibration.joint_inputs import InputModel, input_model
from calibration.joint_model import JointModel, Terms
from calibration.joint_projection import RHO, at_limit
from calibration.joint_samples import Samples, samples_of
from calibration.joint_selection import candidates, worthwhile
from calibration.joint_single import fit_joint, no_correction
from calibration.joint_zero import link_zeros
from calibration.recording import Trial
from calibration.schema import Description
from calibration.verdict import Verdict

STAGE = "joints"
TERMS: Terms = "total"


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
    samples = _samples(trials, inputs, hand, zero)
    options = {joint: worthwhile(candidates(of_joint, terms)) for joint, of_joint in samples.items()}
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
    return JointModels(inputs, zero, tuple(models)), tuple(_verdicts(models, worse, without))


def _samples(
    trials: Sequence[Trial], inputs: InputModel, hand: HandModel, zero: np.ndarray
) -> dict[str, tuple[Samples, ...]]:
    """Samples of every joint of the chain with a link encoder, trial by trial, each with its own payload."""
    rows = [samples_of(inputs.of_trial(trial.id), trial, zero) for trial in trials]
    columns = dict(zip(inputs.measured, zip(*rows, strict=True), strict=True))
    found = {joint: tuple(s for s in columns[joint] if s is not None) for joint in hand.chain.joints}
    return {joint: of_joint for joint, of_joint in found.items() if of_joint}


def _verdicts(models: Sequence[JointModel], worse: Sequence[str], without: Sequence[str]) -> Iterator[Verdict]:
    if without:
        yield Verdict(STAGE, "missing", f"no joint model without a link encoder: {', '.join(without)}")
    used = [m for m in models if m.degree is not None]
    if used:
        yield Verdict(STAGE, "ok", f"{used[0].terms} terms; {'; '.join(_told(m) for m in used)}")
    if worse:
        yield Verdict(STAGE, "ok", f"not corrected, since the hand comes no nearer to its markers: {', '.join(worse)}")
    none = [m.joint for m in models if m.degree is None and m.joint not in worse]
    if none:
        yield Verdict(STAGE, "ok", f"not corrected, since no degree predicts a trial left out: {', '.join(none)}")
    for model in used:
        if model.dropped:
            names = ", ".join(f"A_{i}{j}, B_{i}{j}" for i, j in model.dropped)
            yield Verdict(STAGE, "ok", f"{model.joint}: terms that are zero throughout are left out: {names}")


def _told(model: JointModel) -> str:
    q = model.quality
    limit = f" at a limit of {RHO[0]:g} to {RHO[1]:g}" if at_limit(model.rho) else ""
    return (
        f"{model.joint} degree {model.degree}, rho {model.rho:.3g} s/rad{limit}, {1e3 * q.rms:.1f} -> "
        f"{1e3 * q.residual:.1f} mrad, R2 {q.r2:.2f}, left out {q.r2_out:.2f}"
    )
