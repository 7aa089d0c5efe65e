"""Stage `joints`: the printed joint model of every joint that has a link encoder.

Data: motor minus link reading of all calibration trials, rests included, the mean over the static calibration postures
removed (the zero of readings). Inputs: motor encoders, the geometry's zeros, the nominal robot with its payload.
Choices are judged by models that have not seen the trial they are judged on: which degrees are worth trying in the
joint's own discrepancy (`joint_selection`), which of them, if any, in the hand's error (`joint_hand`).
"""

from collections.abc import Sequence

import numpy as np

from calibration.clock import Clock
from calibration.errors import NotEnoughData
from calibration.hand import HandModel
from calibration.joint_checks import wrong_links
from calibration.joint_correction import JointModels
from calibration.joint_hand import nearest_hand
from calibration.joint_inputs import InputModel, input_model
from calibration.joint_model import Terms
from calibration.joint_samples import Samples, pooled, samples_of
from calibration.joint_selection import candidates, worthwhile
from calibration.joint_single import fit_joint, no_correction
from calibration.joint_verdicts import STAGE, verdicts
from calibration.joint_zero import link_zeros
from calibration.recording import Trial
from calibration.schema import Description
from calibration.verdict import Verdict

TERMS: Terms = "total"
_QUIET = 3.0  # rms of a discrepancy over the noise of a reading, below which there is nothing to model [-]


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
    refused = tuple(wrong_links(inputs.measured, trials, zero))
    if refused:
        return JointModels(inputs, zero, ()), refused
    samples = _samples(trials, inputs, hand, zero)
    quiet = [joint for joint, of_joint in samples.items() if _rms(of_joint) < _QUIET * description.sigmas.encoder]
    tried = {joint: candidates(of_joint, terms) for joint, of_joint in samples.items() if joint not in quiet}
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
