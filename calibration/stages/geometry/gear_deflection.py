"""Stage `geometry`: row `model_2`, and row `full` of static postures: compliance and preloaded backlash of the gears.

    reading = angle + offset + compliance * gravity torque + gap / 2 * tanh(gravity torque / tau_0)

The hand has random errors of its own besides those of the readings, widths of priors follow the data, and which gears
are compliant and have backlash is averaged over. Backlash is fitted unless the postures are strong evidence against it.
On real postures this, by cross-validation, is what reaches furthest; a URDF holds its placements and not its gears. No
motion is needed: where sweeps are recorded it is a row beside those with joint models.

A fit averaged over which gears are compliant: most of a robot's are not, and estimating all of them costs accuracy.
Neither a compliance nor a gap is negative: where the fit finds one below zero by more than 2.5 standard deviations, the
postures show another effect, and that gear is fitted without it and named.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.inference.identifiability import Identifiability, identifiability
from calibration.inference.map_estimate import Fit, spread
from calibration.inference.model_averaging import averaged, log_bayes_factor
from calibration.inference.outliers import RobustFit
from calibration.inference.parameters import Model, ParameterSet
from calibration.mocap.postures import Postures
from calibration.recording.schema import Description
from calibration.robot.blocks import BacklashPreload, Compliance
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.geometry.guards import unusable_fit
from calibration.stages.geometry.hand_residual import HandResidual, NoiseModel
from calibration.stages.geometry.model_of_fit import model_of
from calibration.stages.geometry.parameters import (
    averaged_names,
    compliance_parameters,
    full_parameters,
    hand_model,
    reading_floor,
    reading_sigma,
)
from calibration.stages.geometry.stage import STAGE, calibrate_geometry, fit_robustly, left_out
from calibration.stages.stage import Stage, StageInput, StageResult
from calibration.verdict import Verdict

_HAND = np.array([5e-4, 1e-3])  # random errors of the hand's position [m] and rotation [rad] to begin with
_SPREAD = 720  # components from which rank and combinations are found
_BELOW = 2.5  # standard deviations below zero at which a compliance or a gap is none [-]
_OTHER_SIDE = 0.05  # share of postures whose backlash may lie against its load
_STRONG = np.log(20.0)  # evidence called strong by Kass and Raftery, JASA 1995


def calibrate_gears(chain: Chain, description: Description, postures: Postures) -> tuple[Model, tuple[Verdict, ...]]:
    """The model `full`; a verdict `refused` says that it must not be used."""
    tau = chain.gravity_torques(postures.q)
    parameters, more = (make(chain, description, tau) for make in (compliance_parameters, full_parameters))
    hand, reading = hand_model(chain, nominal_frames(chain, description)), reading_sigma(chain, description)
    floor = reading_floor(chain, description)
    errors = NoiseModel(np.maximum(reading, floor), floor, _HAND[: postures.components // 3])
    found = fit_gears(hand, parameters, more, postures, errors)
    model = model_of("full", chain, found.parameters, found.fit)
    if found.rejected:
        return model, tuple(Verdict(STAGE, "refused", message) for message in found.rejected)
    return model, (*left_out(postures, found.robust, _OTHER_SIDE), *_findings(model, hand), *without(found.negative))


@dataclass(frozen=True)
class GearFit:
    """A fit of geometry and gears.

    Attributes:
        fit: Averaged over which gears are compliant and have backlash.
        robust: Before averaging, with the postures it is of.
        parameters: With backlash, unless the postures are strong evidence against it.
        known: Rank and combinations.
        rejected: Why it must not be used.
        negative: Compliances and gaps it is without, with the values below zero that they had.
    """

    fit: Fit
    robust: RobustFit
    parameters: ParameterSet
    known: Identifiability
    rejected: tuple[str, ...]
    negative: tuple[str, ...] = ()


def fit_gears(
    hand: HandModel, parameters: ParameterSet, more: ParameterSet, postures: Postures, errors: NoiseModel
) -> GearFit:
    """Fit `parameters`, and `more` of them, with backlash, unless the postures are strong evidence against it."""
    found, negative = _fitted(hand, parameters, more, postures, errors), list[str]()
    while not found.rejected and (worst := _below_zero(found, hand)) is not None:
        below, name = found.parameters, found.parameters.names[worst]
        negative.append(f"{name} {1e3 * found.robust.fit.theta[worst]:+.1f} m{below.units[worst]}")
        parameters, more = parameters.without([name]), more.without([name])
        found = _fitted(hand, parameters, more, postures, errors)
    return replace(found, negative=tuple(negative))


def _below_zero(found: GearFit, hand: HandModel) -> int | None:
    """Index of the compliance or gap farthest below zero in standard deviations, before averaging, if it is too far."""
    asked = found.parameters.indices(averaged_names(hand))
    fit = found.robust.fit
    z = fit.theta[asked] / np.sqrt(np.diag(fit.covariance)[asked])
    return asked[int(z.argmin())] if z.min(initial=0.0) < -_BELOW else None


def _fitted(
    hand: HandModel, parameters: ParameterSet, more: ParameterSet, postures: Postures, errors: NoiseModel
) -> GearFit:
    """`fit_gears` with every compliance and gap of any sign."""
    found = fit_robustly(hand, parameters, postures, errors)
    some = spread(len(found.fit.at.r), postures.components, _SPREAD)
    known = identifiability(found.fit.rows_white(some), parameters)
    rejected = tuple(unusable_fit(hand, parameters, found, known, postures))
    if not rejected and _evidence_for_backlash(found, hand, more, postures) > -_STRONG:
        again = fit_robustly(hand, more, postures, errors)
        if again.fit.converged:
            parameters, found = more, again
            known = identifiability(found.fit.rows_white(some[some < len(found.fit.at.r)]), parameters)
    return GearFit(_averaged(found.fit, parameters, hand), found, parameters, known, rejected)


def _evidence_for_backlash(found: RobustFit, hand: HandModel, more: ParameterSet, postures: Postures) -> float:
    """Log Bayes factor of the backlash of `more` parameters over a fit without."""
    new = [i for i, name in enumerate(more.names) if name in hand.block(BacklashPreload).names]
    theta = more.nominal.copy()
    theta[[i for i in range(len(more)) if i not in new]] = found.fit.theta
    none = NoiseModel(np.zeros(0), np.zeros(0), np.zeros(0))
    at = HandResidual(hand, more.names, postures.rows(found.kept), none).linearise(theta)
    return log_bayes_factor(found.fit, at.J[:, :, new], more.tolerance[new])


def _findings(model: Model, hand: HandModel) -> Iterator[Verdict]:
    """What was found of the gears."""
    for kind, what, unit in (
        (Compliance, "gears compliant under gravity", "mrad/(N.m)"),
        (BacklashPreload, "backlash preloaded by gravity", "mrad"),
    ):
        mine = [p for p in model.parameters if p.name in hand.block(kind).names]
        sizes = ", ".join(f"{p.name} {1e3 * p.value:+.1f} {unit}" for p in mine if abs(p.value) > 2.0 * p.sigma)
        if mine:
            yield Verdict(STAGE, "ok", f"{what}: {sizes or 'none'}")


def without(negative: Sequence[str]) -> Iterator[Verdict]:
    """Which compliances and gaps the fit is without because they came out negative."""
    if negative:
        message = f"fitted without what was below zero by {_BELOW} standard deviations: {', '.join(negative)}"
        yield Verdict(STAGE, "ok", f"{message}; these postures show an effect the model does not have")


def _averaged(fit: Fit, parameters: ParameterSet, hand: HandModel) -> Fit:
    """The fit with theta and covariance averaged; `at`'s residuals stay those of all gears compliant."""
    asked = np.array(parameters.indices(averaged_names(hand)))
    width = np.sqrt(parameters.prior.factor(fit.widths.prior)[asked]) * parameters.tolerance[asked]
    found = averaged(fit.theta, fit.covariance, asked, width)
    return replace(fit, at=replace(fit.at, theta=found.theta), covariance=found.covariance)


def _run(data: StageInput) -> StageResult:
    """Both rows; no `full` where `model_2` is rejected, or where it alone is and joint models follow."""
    chain, description, postures = data.lab.chain, data.lab.description, data.static
    model, findings = calibrate_geometry(chain, description, postures)
    if any(v.verdict == "refused" for v in findings):
        return StageResult((model,), findings)
    full, more = calibrate_gears(chain, description, postures)
    wrong = [v.message for v in more if v.verdict == "refused"]
    if wrong and data.moving:
        return StageResult((model,), (*findings, Verdict(STAGE, "warning", f"no row `full`: {'; '.join(wrong)}")))
    return StageResult((model, full), (*findings, *(v for v in more if v not in findings)))


GEOMETRY = Stage(STAGE, _run)
