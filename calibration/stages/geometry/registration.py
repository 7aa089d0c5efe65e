"""Stage `registration`: nominal geometry, the two marker bodies placed where the data say.

    minimise  sum_i mean_m |p_m + phi_i x c_m|^2 / tolerance^2                                      12 parameters
              (p_m, phi_i) = log6(T_measured_i^-1 T_base_B^-1 T_base_tool(q_i) T_tool_H),   c_m markers in H

The baseline, plain least squares of the hand's markers: what is left after it is geometry, zeros, backlash and
the base. Those errors are millimetres where the markers' noise is a tenth of one, so all markers weigh alike, and
postures passed through in swings count beside the static ones: a baseline must not hang on where the statics lie.
A posture much farther from the others' fit than they are, `_OUTLIER` times their median squared distance, is excluded
and named: a robot's own errors are much alike over its workspace. The start minimises distances, not their squares.
Samples of one swing hang together in time, by the robot's own errors foremost: the covariance is summed over blocks of
several correlation times, each static posture being one (`block_covariance`). With the arm alone moving, all twelve
are identifiable once it turns about two directions; where the base stands in the lab is not asked.
"""

from dataclasses import replace

import numpy as np
import pinocchio as pin

from calibration.errors import NotEnoughData
from calibration.inference.map_estimate import Fit
from calibration.inference.parameters import Model, ParameterSet
from calibration.mocap.postures import Postures
from calibration.numerics.alignment import registration_start
from calibration.numerics.lie import inverse, skew
from calibration.numerics.robust_covariance import block_covariance
from calibration.recording.schema import Description
from calibration.robot.blocks import Frames
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel, nominal_hand
from calibration.stages.geometry.departures import with_departures
from calibration.stages.geometry.hand_residual import fit_weighted, linearised
from calibration.stages.geometry.model_of_fit import model_of
from calibration.stages.geometry.parameters import hand_model, registration_parameters
from calibration.stages.stage import Stage, StageInput, StageResult
from calibration.verdict import Verdict

STAGE = "registration"
_OUTLIER = 16.0  # squared distance over the median one [-]; 2 to 6 is the farthest of clean recordings
_NEAR = 1e-2  # squared distance, in tolerances, that is never an outlier [-]
_ROUNDS = 6
_TRIANGLE = 3  # markers that determine a pose
_STEPS = 20
_STILL = 1e-10  # [m, rad]


def register(
    chain: Chain, description: Description, postures: Postures, judged: bool = True
) -> tuple[Model, tuple[Verdict, ...]]:
    """The two frames, and the verdicts on them; none, and no errors the residuals show, where it is not `judged`."""
    parameters, tol = registration_parameters(chain, description), description.tolerances
    n_seen = 6 + postures.components  # a point does not show how the hand is turned: that stays as widths
    widths = np.where(np.arange(12) < n_seen, parameters.tolerance, tol.body_rotation)
    parameters = replace(parameters, tolerance=widths)
    W = frame_weights(description)[: postures.components, : postures.components]
    found, kept = _without_outliers(nominal_hand(chain, parameters.nominal), parameters, postures, W)
    model = model_of(STAGE, chain, parameters, found)
    if not judged:
        return model, ()
    if not found.converged:
        return model, (Verdict(STAGE, "warning", "the fit of the two marker frames did not converge"),)
    if model.rank < n_seen:
        message = (
            f"{n_seen - model.rank} of {n_seen} directions are not identified: the arm turned about one axis only, "
            "so a turn of both frames about it is not identifiable; move another joint"
        )
        return model, (Verdict(STAGE, "warning", message),)
    used = postures.rows(kept)
    in_time = _in_time(found, parameters, used.motion)
    departed = with_departures(hand_model(chain, parameters.nominal), parameters, in_time, used)
    model = replace(model_of(STAGE, chain, parameters, departed.fit), random=in_time.covariance)
    model = replace(model, hand_error=_hand_error(found.at.r, used.motion))
    shift = 1e3 * np.linalg.norm(found.theta[6:9] - parameters.nominal[6:9])
    message = f"marker frames from {kept.sum()} postures; hand {shift:.1f} mm from nominal"
    verdicts = [Verdict(STAGE, "ok", "; ".join((message, *departed.shown)))]
    if not kept.all():
        outliers = np.flatnonzero(~kept)
        names = ", ".join(postures.label[outliers] if len(postures.label) else outliers.astype(str))
        message = f"{len(outliers)} of {len(kept)} postures are outliers and were excluded from the registration"
        verdicts.append(Verdict(STAGE, "warning", f"{message}, counted from 0: {names}"))
    return model, tuple(verdicts)


def _hand_error(r: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Errors of the hand's place [m] and, where seen, rotation [rad], per component, of residuals r (n, d).

    Those of the motion, or of the static postures, that fit worst: a new motion is not known to fit better.
    """
    squares = [(r[motion == k].reshape(-1, r.shape[1] // 3, 3) ** 2).mean(axis=(0, 2)) for k in np.unique(motion)]
    return np.sqrt(np.max(squares, axis=0))


def _in_time(found: Fit, parameters: ParameterSet, motion: np.ndarray) -> Fit:
    """The fit, samples of one `motion` (n,) no longer taken for independent; as it is where the arm always stood."""
    if (motion < 0).all():
        return found
    J, prior = found.whitener @ found.at.J, 1.0 / parameters.tolerance**2
    swings = [np.flatnonzero(motion == k) for k in np.unique(motion[motion >= 0])]
    series = [*np.flatnonzero(motion < 0)[:, None], *swings]
    blocks = block_covariance([J[rows] for rows in series], [found.r_white[rows] for rows in series], prior)
    H = found.J_white.T @ found.J_white + np.diag(prior)
    widths = np.linalg.solve(H, np.diag(np.sqrt(prior)))
    return replace(found, covariance=blocks.covariance + widths @ widths.T)


def _without_outliers(
    hand: HandModel, parameters: ParameterSet, postures: Postures, W: np.ndarray
) -> tuple[Fit, np.ndarray]:
    """The fit of the postures that agree, each residual times W (d, d), and which (n,) they are."""

    def distance(theta: np.ndarray) -> np.ndarray:
        return np.asarray(((linearised(hand, theta, postures, parameters.names).r @ W.T) ** 2).sum(axis=1))

    def near(distance: np.ndarray) -> np.ndarray:
        return distance <= max(_OUTLIER * float(np.median(distance)), _NEAR)

    start = registration_start(hand.chain.poses(postures.q), postures.T_base_hand, postures.components == 6).frames
    kept = near(min((distance(theta) for theta in (start, parameters.nominal)), key=np.median))
    for _ in range(_ROUNDS):
        used = kept
        found = fit_weighted(hand, parameters, postures.rows(used), np.tile(W, (int(used.sum()), 1, 1)))
        kept = near(distance(found.theta))
        if np.array_equal(kept, used):
            break
    return found, used


def frame_weights(description: Description) -> np.ndarray:
    """W (6, 6) [1/m, 1/rad]: |W x| is the rms distance that a local twist x moves the hand's markers, in tolerances.

    Where fewer than three markers are known, |W x| are its components in tolerances of a marker body.
    """
    tol, markers = description.tolerances, np.array([m.xyz for m in description.hand_body.markers])
    if len(markers) < _TRIANGLE:
        return np.diag(1.0 / np.repeat([tol.body_translation, tol.body_rotation], 3))
    moves = np.concatenate([np.tile(np.eye(3), (len(markers), 1, 1)), -skew(markers)], axis=2).reshape(-1, 6)
    return np.asarray(np.linalg.qr(moves, mode="r") / (tol.body_translation * np.sqrt(len(markers))))


def fit_frames(model: HandModel, q: np.ndarray, T_measured: np.ndarray, description: Description) -> HandModel:
    """The model with both marker frames fitted to T_measured (n, 4, 4) at q (n, n_joints).

    Raises:
        NotEnoughData: Fewer than two postures, or they turn the hand about one direction only.
    """
    W = frame_weights(description)
    if len(q) < 2:
        raise NotEnoughData(f"{len(q)} registration postures of the confirmation session show base and hand; make more")
    for _ in range(_STEPS):
        found = model.poses_and_derivatives(q, names=model.block(Frames).names)
        r = np.array([pin.log6(pin.SE3(E)).vector for E in inverse(T_measured) @ found.T])
        J = (W @ found.J).reshape(-1, 12)
        if np.linalg.matrix_rank(J, rtol=1e-6) < 12:
            raise NotEnoughData(
                f"the {len(q)} registration postures of the confirmation session turn the hand about one direction only"
            )
        step = np.linalg.lstsq(J, -(r @ W.T).ravel(), rcond=None)[0]
        frames = model.block(Frames)
        model = model.with_theta(frames.values + step, frames.names)
        if np.abs(step).max() < _STILL:
            break
    return model


def _run(data: StageInput) -> StageResult:
    postures = data.static if data.passing is None else data.static.joined(data.passing)
    model, findings = register(data.lab.chain, data.lab.description, postures)
    return StageResult((model,), findings)


REGISTRATION = Stage(STAGE, _run)
