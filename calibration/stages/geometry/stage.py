"""Stage `geometry`: joint placements, zeros of the readings and marker frames, datasheet tolerances as priors.

See `map_fit` for the cost and `hand` for the model. With 6D markers on base and hand a chain of R revolute and P
prismatic joints has 4 R + 2 P + 6 identifiable combinations: 36 for a torso and seven arm joints, 34 with the torso
still. What the data do not separate stays at what the tolerances make most likely. Postures that contradict all others
are left out and named.

Compliance and preloaded backlash of the gears are those of row `full`, see `gear_deflection`.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.special import chdtri

from calibration.inference.identifiability import identifiability
from calibration.inference.outliers import RARE, RobustFit, robust_fit
from calibration.inference.parameters import Model, ParameterSet
from calibration.inference.small_sample import small_sample_covariance
from calibration.mocap.cluster_shape import of_one_shape
from calibration.mocap.postures import Postures
from calibration.numerics.alignment import registration_start
from calibration.recording.schema import Description
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel
from calibration.robot.nominal_frames import nominal_frames
from calibration.robot.parameter_block import joint_lengths
from calibration.stages.geometry.departures import shown_by, with_departures
from calibration.stages.geometry.guards import (
    APART,
    CONDITION,
    MANY_ODD,
    READING,
    few,
    implausible,
    recommended,
    spans,
    too_little,
    unusable_data,
)
from calibration.stages.geometry.hand_residual import NoiseModel, hand_problem
from calibration.stages.geometry.model_of_fit import model_of
from calibration.stages.geometry.parameters import geometry_parameters, hand_model, reading_floor, reading_sigma
from calibration.verdict import Verdict

STAGE = "geometry"
_OTHER_SIDE = 0.1  # share of postures of which one joint may be on the other side of its backlash


def calibrate_geometry(
    chain: Chain, description: Description, postures: Postures, judged: bool = True
) -> tuple[Model, tuple[Verdict, ...]]:
    """The geometric model; a verdict `refused` says that it must not be used.

    Where it is not `judged`, what its residuals show is left out of intervals and verdicts.
    """
    parameters, hand = geometry_parameters(chain, description), hand_model(chain, nominal_frames(chain, description))
    start, floor = reading_sigma(chain, description), reading_floor(chain, description)
    errors = NoiseModel(np.maximum(start, floor), floor, np.zeros(0), stated=True)
    robust = fit_robustly(hand, parameters, postures, errors)
    found = robust.fit
    known = identifiability(found.J_white, parameters)
    oriented = postures.components == 6
    frames = registration_start(chain.poses(postures.q), postures.T_base_hand, oriented)
    refused = [*unusable_data(chain, postures.q, frames, postures.components)]
    unclear, scarce = list(too_little(known, CONDITION[postures.components])), few(chain, postures)
    refused = refused or [*([] if scarce else unclear), *implausible(parameters, robust.fit, start, hand)]
    verdicts = [Verdict(STAGE, "refused", message) for message in refused]
    if scarce and not refused:
        message = f"fewer than the {recommended(chain, postures.components)} distinct postures recommended"
        verdicts.append(Verdict(STAGE, "warning", f"{message}; what they do not show stays near nominal"))
    verdicts += left_out(postures, robust, 0.0, other_sides(hand, parameters, postures, errors, robust))
    still = [name for name, span in zip(chain.joints, spans(chain, postures), strict=True) if span < APART]
    if still:
        verdicts.append(
            Verdict(STAGE, "warning", f"joints that never moved are calibrated at their position only: {still}")
        )
    if not refused:
        message = f"{known.rank} combinations of {len(parameters)} parameters from {robust.kept.sum()} postures"
        verdicts.append(Verdict(STAGE, "ok", f"{message}, condition {known.condition:.0f}"))
    if not oriented:
        message = "a point of the hand was seen: hand orientation is not observable and fixed at nominal"
        verdicts.append(Verdict(STAGE, "warning", f"{message}; put three markers on it"))
    if not judged:
        return model_of("model_2", chain, parameters, found), tuple(verdicts)
    used = postures.rows(robust.kept)
    departed = with_departures(hand, parameters, replace(found, covariance=small_sample_covariance(found)), used)
    verdicts += [Verdict(STAGE, "ok", message) for message in departed.shown]
    return replace(
        model_of("model_2", chain, parameters, departed.fit),
        random=found.covariance,
        absorption=departed.absorbed,
        tests=shown_by(hand, parameters, found, used),
    ), tuple(verdicts)


def fit_robustly(hand: HandModel, parameters: ParameterSet, postures: Postures, errors: NoiseModel) -> RobustFit:
    """The fit of the postures that agree, from nominal values; none whose markers do not have their body's shape."""
    n, shape, means = len(postures), np.ones(len(postures), dtype=bool), postures.motion < 0
    shape[means] = of_one_shape(postures.misfit[means])  # single samples of a motion have no misfit
    rigid = np.flatnonzero(shape)
    found = robust_fit(
        lambda some: hand_problem(hand, parameters, postures.rows(rigid[some]), errors),
        len(rigid),
        postures.components,
        parameters.nominal,
    )
    kept, distance = np.zeros(n, dtype=bool), np.full(n, np.inf)
    kept[rigid], distance[rigid] = found.kept, found.distance
    return RobustFit(found.fit, kept, distance)


def other_sides(
    hand: HandModel, parameters: ParameterSet, postures: Postures, errors: NoiseModel, found: RobustFit
) -> np.ndarray:
    """Which postures left out (n,) one joint's reading explains, off by no more than the largest plausible backlash.

    Of 20 postures, one may be the only one with its link on the other side of a gap: r = b_j x + noise, chi-square.
    """
    explained = np.zeros(len(postures), dtype=bool)
    odd = np.flatnonzero(~found.kept & np.isfinite(found.distance))
    if not len(odd):
        return explained
    problem = hand_problem(hand, parameters, postures.rows(odd), errors)
    at, lengths = problem.linearise(found.fit.theta), joint_lengths(hand.nominal)
    W = problem.noise.roots(at.B, found.fit.widths.noise)
    A, r, b = W @ at.J, (W @ at.r[..., None])[..., 0], W @ at.B[:, :, : len(lengths)]
    P = np.linalg.inv(np.eye(r.shape[1]) + A @ found.fit.covariance @ np.swapaxes(A, 1, 2))
    along, size = np.einsum("nij,nil,nl->nj", b, P, r), np.einsum("nij,nil,nlj->nj", b, P, b)
    rest = np.einsum("ni,nij,nj->n", r, P, r)[:, None] - along**2 / size
    small = np.abs(along / size) <= 2.0 * READING * lengths
    explained[odd] = (small & (rest <= chdtri(r.shape[1] - 1, RARE))).any(axis=1)
    return explained


def left_out(
    postures: Postures, found: RobustFit, usual: float = 0.0, explained: np.ndarray | None = None
) -> Iterator[Verdict]:
    """The postures that were not used, by name; up to a share `usual` of good ones contradict a fine model as well.

    A joint on the other side explains one only where it explains all: beside wrong postures it may be wrong, too.
    """
    odd, n = ~found.kept, len(postures)
    sides = odd & explained if explained is not None else np.zeros(n, dtype=bool)
    if (odd & ~sides).any() or sides.sum() > _OTHER_SIDE * n:
        sides = np.zeros(n, dtype=bool)
    name = postures.label if len(postures.label) else np.arange(n).astype(str)
    if sides.any():
        message = f"{sides.sum()} of {n} postures have a joint on the other side of its backlash"
        yield Verdict(STAGE, "ok", f"{message} and were left out, counted from 0: {', '.join(name[sides])}")
    odd = odd & ~sides
    if odd.any():
        message = f"{odd.sum()} of {n} postures contradict the others and were left out, counted from 0: "
        share = odd.sum() / n
        message += ", ".join(name[odd])
        yield Verdict(STAGE, "refused" if share > MANY_ODD else "warning" if share > usual else "ok", message)
