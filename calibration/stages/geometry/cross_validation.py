"""Error of the hand at calibration postures that were left out in turn.

    e_i = |p_B_H(q_i, theta_without_fold(i)) - p_i|       [m]
    rmse = sqrt(mean e_i^2),   interval: the middle 95 % of its values over bootstrap samples of the postures
    excess = max(1, sqrt(mean e_i^2 / E_i)),    E_i = tr C_i, the mean square stated for i by its fold's fit

Folds are random fifths of the distinct postures; repeated ones are left out together. The row of the smallest error is
delivered: few postures leave a geometry to its priors, which may be worse than none. Marker bodies whose shape or place
was taken from these very postures are not made again without them; tests/data's postures show what that leaves out.
An interval over postures says nothing of another session.

Row `full` chooses from the same few postures which random errors there are, and takes their sizes for known: what it
states is too small, by how much `excess` shows. All its standard deviations are multiplied by it. Where priors decide
most (`few`), C_i is of the fit of all postures, i among them: a fold's may have quite other random errors.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from calibration.errors import CalibrationError
from calibration.inference import Model
from calibration.inference.parameters import scaled
from calibration.mocap.postures import Postures
from calibration.numerics.lie import places
from calibration.recording import Description
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel
from calibration.robot.hand_uncertainty import Spread, predicted_points
from calibration.robot.nominal_frames import nominal_frames
from calibration.robot.parameter_block import joint_lengths
from calibration.stages.geometry.gear_deflection import calibrate_gears
from calibration.stages.geometry.guards import APART, distinct, few, fewest, groups
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.stages.geometry.registration import STAGE as BASELINE
from calibration.stages.geometry.registration import register
from calibration.stages.geometry.stage import STAGE, calibrate_geometry
from calibration.verdict import Verdict

Fitted = tuple[HandModel, Spread | None]
"""A calibrated robot and how uncertain it states to be; None where it states nothing."""

FOLDS = 5
_SAMPLES = 2000  # of the bootstrap
_SHOWN = 4  # parameters worth looking at
_FAR = 3.0  # standard deviations from nominal beyond which a parameter is worth looking at


@dataclass(frozen=True)
class LeftOut:
    """Errors at postures left out.

    Attributes:
        model: Row of the ladder.
        error: (n,) distance of the hand or its point [m]; NaN where a fold could not be fitted.
        stated: (n,) its root mean square as stated [m]; of `full` only, NaN of other rows.
        residual: Root mean squared distance where all postures were fitted [m].
    """

    model: str
    error: np.ndarray
    stated: np.ndarray
    residual: float

    @property
    def excess(self) -> float:
        """Root mean square of the errors over those stated [-], at least 1."""
        ratio = (self.error / self.stated) ** 2
        return max(1.0, float(np.sqrt(np.nanmean(ratio)))) if np.isfinite(ratio).any() else 1.0

    @property
    def rmse(self) -> float:
        """Root mean squared distance [m]."""
        return _rms(self.error)

    @property
    def interval(self) -> tuple[float, float]:
        """95 % of the rmse over samples of the postures [m]."""
        e = self.error[np.isfinite(self.error)] ** 2
        rows = np.random.default_rng(0).integers(len(e), size=(_SAMPLES, len(e)))
        low, high = np.percentile(np.sqrt(e[rows].mean(axis=1)), (2.5, 97.5))
        return float(low), float(high)


@dataclass(frozen=True)
class CrossValidation:
    """What postures left out say of the rows fitted to postures.

    Attributes:
        verdicts: The error of each row, and parameters far from nominal.
        best: The row of the smallest error; empty where none is to be had.
        excess: Factor on the standard deviations of row `full`.
    """

    verdicts: tuple[Verdict, ...] = ()
    best: str = ""
    excess: float = 1.0


def left_out_errors(
    chain: Chain, description: Description, postures: Postures, names: tuple[str, ...]
) -> tuple[LeftOut, ...]:
    """Of `registration`, `model_2` and `full`, those of `names`; rows that could be fitted in no fold are absent."""
    found = (errors_left_out(name, partial(_fitted, name, chain, description), chain, postures) for name in names)
    return tuple(f for f in found if np.isfinite(f.error).any())


def errors_left_out(name: str, fit: Callable[[Postures], Fitted | None], chain: Chain, postures: Postures) -> LeftOut:
    """Of a row of any `fit` to some of the postures; None where that must not be used."""
    of = groups(postures.q[:, chain.columns], APART * joint_lengths(chain))
    parts = np.array_split(np.random.default_rng(0).permutation(of.max() + 1), FOLDS)
    whole, stated = _errors(fit(postures), postures)
    error = np.full(len(postures), np.nan)
    for part in (np.flatnonzero(np.isin(of, part)) for part in parts):
        kept = np.setdiff1d(np.arange(len(postures)), part)
        error[part], own = _errors(fit(postures.rows(kept)), postures.rows(part))
        stated[part] = stated[part] if few(chain, postures) else own
    return LeftOut(name, error, stated, _rms(whole))


def as_left_out(chain: Chain, description: Description, postures: Postures, full: Model) -> Model:
    """Row `full` of the postures with the standard deviations that postures left out show."""
    return scaled(full, max((f.excess for f in left_out_errors(chain, description, postures, ("full",))), default=1.0))


def cross_validated(
    chain: Chain, description: Description, postures: Postures, models: tuple[Model, ...], main: str
) -> CrossValidation:
    """The main row beside those below it at postures left out.

    Args:
        chain: Nominal.
        description: Of the dataset.
        postures: Of the calibration.
        models: Of the estimate.
        main: The row of the estimate that is judged.
    """
    row = main if main in _FITS else "model_2"
    fitted = {m.name: m for m in models if m.name in _FITS}
    if row not in fitted:
        return CrossValidation()
    names = [name for name in _FITS if name in fitted][: list(_FITS).index(row) + 1]
    n = distinct(postures.q[:, chain.columns], APART * joint_lengths(chain))
    enough = n * (FOLDS - 1) >= fewest(postures.components) * FOLDS
    found = left_out_errors(chain, description, postures, tuple(names)) if enough else ()
    best = min(found, key=lambda f: f.rmse, default=None)
    if best is None or row not in {f.model for f in found}:
        message = f"no cross-validated error of {row}: {n} distinct postures are too few to leave a fifth out"
        return CrossValidation((_not_better(message, BASELINE),), BASELINE)
    message, excess = _errors_in_words(row, found), max(f.excess for f in found)
    message += multiplied(excess)
    if best.model != row:
        return CrossValidation((_not_better(message, best.model),), best.model, excess)
    verdicts = [Verdict(STAGE, "ok", message), *_worth_looking_at(scaled(fitted[row], excess))]
    if row == list(fitted)[-1]:
        verdicts.append(_more(best))
    return CrossValidation(tuple(verdicts), row, excess)


def _errors_in_words(row: str, found: tuple[LeftOut, ...]) -> str:
    mine = next(f for f in found if f.model == row)
    beside = "".join(
        f", {f.model} {1e3 * f.rmse:.2f} mm (residual {1e3 * f.residual:.2f})" for f in found if f is not mine
    )
    return f"{in_words(mine)}{beside}; {np.isfinite(mine.error).sum()} postures, {FOLDS} folds"


def in_words(found: LeftOut) -> str:
    """The error of a row with its interval, and beside it the residual."""
    low, high = found.interval
    return (
        f"{found.model}: hand error at left-out postures {1e3 * found.rmse:.2f} mm rms (95 % interval "
        f"{1e3 * low:.2f} to {1e3 * high:.2f}, residual {1e3 * found.residual:.2f})"
    )


def multiplied(excess: float) -> str:
    """What an excess does; empty where it is 1."""
    why = f"standard deviations of full are multiplied by {excess:.2f}, errors left out over those stated"
    return f"; {why}" if excess > 1.0 else ""


def _not_better(message: str, delivered: str) -> Verdict:
    action = f"{delivered} is delivered; record more postures, spread over all joints"
    return Verdict(STAGE, "warning", f"{message}: not better than {delivered} at postures left out, so {action}")


def _fitted(name: str, chain: Chain, description: Description, postures: Postures) -> Fitted | None:
    """A row of the ladder, with what `full` states; None where it must not be used."""
    try:
        model, findings = _FITS[name](chain, description, postures)
    except CalibrationError:
        return None
    if any(v.verdict == "refused" for v in findings):
        return None
    names = tuple(p.name for p in model.parameters)
    spread = Spread(names, model.covariance, model.reading_sigma, model.hand_error) if name == "full" else None
    return hand_of(model, chain, nominal_frames(chain, description)), spread


def _errors(fitted: Fitted | None, predicted: Postures) -> np.ndarray:
    """Distances and those stated (2, n) [m] at postures; NaN where there is no fit, or it states none."""
    found = np.full((2, len(predicted)), np.nan)
    if fitted is None:
        return found
    hand, spread = fitted
    if spread is not None:
        S = predicted_points(hand, spread, predicted.point[None], predicted.q).covariance[:, 0]
        found[1] = np.sqrt(np.trace(S + predicted.covariance[:, :3, :3], axis1=1, axis2=2))
    p, T_seen = places(hand.poses(predicted.q), predicted.point), predicted.T_base_hand
    seen = T_seen[:, :3, 3] if predicted.components == 3 else places(T_seen, predicted.point)
    found[0] = np.linalg.norm(p - seen, axis=1)
    return found


def _worth_looking_at(model: Model) -> tuple[Verdict, ...]:
    """Parameters of the robot that are farthest from nominal, in standard deviations."""
    mine = [p for p in model.parameters if p.status == "estimated" and p.name.startswith(("encoder.", "geometry."))]
    far = sorted(
        (p for p in mine if abs(p.value - p.nominal) > _FAR * p.sigma),
        key=lambda p: -abs(p.value - p.nominal) / p.sigma,
    )
    if not far:
        return ()
    shown = ", ".join(
        f"{p.name} {1e3 * (p.value - p.nominal):+.1f} +- {1e3 * p.sigma:.1f} m{p.unit}" for p in far[:_SHOWN]
    )
    return (Verdict(STAGE, "ok", f"farthest from nominal in standard deviations: {shown}"),)


def _more(mine: LeftOut) -> Verdict:
    """What more postures are worth at least.

    With p parameters and n postures the squares of residual and error are s^2 (1 - p / n) and s^2 (1 + p / n).
    From halves of 37 postures of a real robot this expects 3.1 mm; 2.1 are left.
    """
    twice = np.sqrt(0.25 * mine.residual**2 + 0.75 * mine.rmse**2)
    message = f"to record next: twice as many postures would leave {1e3 * twice:.2f} mm or less"
    return Verdict(STAGE, "ok", f"{message} instead of {1e3 * mine.rmse:.2f}")


def _rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(error**2)))


_FITS: Mapping[str, Callable[[Chain, Description, Postures], tuple[Model, tuple[Verdict, ...]]]] = {
    BASELINE: partial(register, judged=False),
    "model_2": partial(calibrate_geometry, judged=False),
    "full": calibrate_gears,
}
