"""The robot's clock once more, from whole poses, a provisional geometry and the joints preloaded by gravity.

    r(t) = log6(T_measured(t)^-1 T_B_H(q(t - lag)))
         = (lag + drift (t - t0)) sum_held J_j dq_j + sum_others d_j J_j dq_j + J_theta e + noise
           + sum_held J_j (o_j+- + a_j q_j + b_j tau_j + h_jw lost_w(q_j))

Behind a gear the link is not where the motor is, and a gear without load lags by 4 gap / (pi amplitude omega): ten
milliseconds and more. So a joint is evidence of the clock only while its gravity torque tau_j keeps it on a flank;
zeros of either flank, elasticity and dry friction (two narrow play operators, weights of 1) are its nuisances.
Otherwise it has a lag of its own and random errors as large as any gear's. e are the errors of the provisional
geometry, as large as its fit says. The remaining noise is the markers' and each joint's random reading error, by its
lever arm.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.mocap.postures import Postures, passing_postures, static_postures
from calibration.numerics.lie import inverse, rotation_vector
from calibration.numerics.side_by_side import side_by_side
from calibration.numerics.time_delay import Lag
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.clocks.clock_fit import TrialLag, fit_clock
from calibration.stages.clocks.lag_covariance import lag_and_drift, without_nuisances
from calibration.stages.clocks.plate_moments import JointMotion
from calibration.stages.clocks.pose_samples import Samples, read_samples
from calibration.stages.geometry.hand_residual import fit
from calibration.stages.geometry.parameters import (
    geometry_parameters,
    hand_model,
    reading_floor,
    reading_names,
    reading_sigma,
)

_SPACING, _PASSED = 0.5, 250  # [s] between postures passed through, at least; so many of them, about
_MOVES = 0.05  # [rad, m] a joint must move to count as moving
_LOADED, _TORQUE = 0.1, 0.3  # a joint is loaded while |tau| exceeds this share of its largest, and this [N.m, N]
_FREE = 0.02  # [rad, m] random error of a joint that is not loaded: more than any gear's play
_STRIDES = (4, 1)  # of the samples, pass by pass
_UNKNOWN = 0.1  # [s] standard deviation of a lag that says less than angular velocities do
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Provisional:
    """A robot good enough to compare clocks by.

    Attributes:
        hand: Calibrated on the static postures.
        names: Of the parameters it was calibrated in, length p.
        root: (p, p) Cholesky factor of their covariance.
        reading_sigma: (k,) random reading error of each joint [rad, m].
        largest: (k,) largest gravity torque of each joint in the campaign [N.m, N].
    """

    hand: HandModel
    names: tuple[str, ...]
    root: np.ndarray
    reading_sigma: np.ndarray
    largest: np.ndarray


def provisional(chain: Chain, description: Description, trials: Sequence[Trial], robot: Clock) -> Provisional:
    """Calibrate on the static postures and on those passed through, with an approximate clock.

    Raises:
        NotEnoughData: Base and hand are not seen together, or a fit that does not converge.
    """
    parameters = geometry_parameters(chain, description)
    nominal = hand_model(chain, nominal_frames(chain, description))
    postures = _postures(description, trials, robot)
    start, floor = reading_sigma(chain, description), reading_floor(chain, description)
    found = fit(nominal, parameters, postures, start, floor)
    if not found.converged:
        raise NotEnoughData("the provisional geometry did not converge")
    hand = nominal.with_theta(found.theta, parameters.names)
    some = np.concatenate([trial.q_motor[:: max(1, len(trial.t_robot) // 200)] for trial in trials])
    play, largest = found.noise_sigma(reading_names(chain)), np.abs(_gravity_torques(hand, some)).max(axis=0)
    return Provisional(hand, parameters.names, np.linalg.cholesky(found.covariance), play, largest)


def _postures(description: Description, trials: Sequence[Trial], robot: Clock) -> Postures:
    """Static postures, if any, and those passed through, evenly spaced over all trials."""
    seconds = sum(float(trial.t_mocap[-1] - trial.t_mocap[0]) for trial in trials)
    passed = passing_postures(description, trials, robot, max(_SPACING, seconds / _PASSED))
    try:
        return static_postures(description, trials, robot).joined(passed)
    except NotEnoughData:
        return passed


def refined_lags(
    robot: Provisional, description: Description, trials: Sequence[Trial], clock: Clock, stride: int = 1
) -> list[TrialLag]:
    """Lags of the trials that move loaded joints, around an approximate clock, by one sample of so many."""

    def found(trial: Trial) -> TrialLag | None:
        try:
            samples = read_samples(MeasuredTrial.of(description, trial), clock, calm=True)
            return _refined(robot, samples.thinned(stride), trial.id, clock)
        except NotEnoughData as error:
            _log.info("%s: %s", trial.id, error)
            return None

    return [lag for lag in side_by_side(found, trials) if lag is not None]


def link_angles(robot: Provisional, description: Description, trial: Trial, clock: Clock) -> JointMotion:
    """Joint angles behind the gears: readings, less their zeros, moved by what the hand's pose shows.

        e = -D J' (S + J D J')^-1 r,     D = diag(play^2)

    Joints that are not on the way to the hand keep their readings.
    """
    x = read_samples(MeasuredTrial.of(description, trial), clock, calm=False)
    J, D = robot.hand.joint_jacobians(x.q), robot.reading_sigma**2
    r = _residuals(x.T, robot.hand.poses(x.q))
    C = x.covariance + (J * D) @ np.swapaxes(J, 1, 2)
    q = robot.hand.angles(x.q)
    q[:, robot.hand.chain.columns] -= D * np.einsum("nik,ni->nk", J, np.linalg.solve(C, r[..., None])[..., 0])
    return JointMotion(x.t, q)


def _refined(robot: Provisional, x: Samples, trial_id: str, clock: Clock) -> TrialLag:
    """Lag and drift of one trial around an approximate clock, the nuisances eliminated."""
    hand, columns = robot.hand, robot.hand.chain.columns
    q, v, tau = x.q[:, columns], x.v[:, columns], _gravity_torques(hand, x.q)
    loaded = np.abs(tau) > np.maximum(_TORQUE, _LOADED * robot.largest)
    speaks = loaded & (np.ptp(np.where(loaded, q, _median(q, loaded)), axis=0) > _MOVES)
    if not speaks.any():
        raise NotEnoughData("no joint moves that gravity preloads on one flank")
    at = hand.poses_and_derivatives(x.q, tau, robot.names)
    moved = at.J_joint * np.where(loaded, robot.reading_sigma, np.maximum(robot.reading_sigma, _FREE))[:, None]
    W = np.linalg.inv(np.linalg.cholesky(x.covariance + moved @ np.swapaxes(moved, 1, 2)))
    J = W @ at.J_joint
    shapes = np.stack([v * ~speaks, *(speaks * shape for shape in (tau > 0.0, tau < 0.0, q - q.mean(axis=0), tau))], 1)
    lost = speaks[:, None] * np.swapaxes(x.lost[:, columns], 1, 2)
    A, played = _terms(J, shapes), _terms(J, lost)
    B = np.column_stack([(W @ at.J).reshape(len(played), -1) @ robot.root, played])
    slope = (J @ (v * speaks)[..., None])[..., 0]
    middle = float(np.average(x.t, weights=(slope**2).sum(axis=1)))
    r = W @ _residuals(x.T, at.T)[..., None]
    S = np.stack([slope, slope * (x.t - middle)[:, None]], axis=2).reshape(-1, 2)
    reduced = without_nuisances(A, B, r.ravel(), S, x.t)
    change, C = lag_and_drift(reduced)
    wound = played @ reduced.coefficients(change)[len(robot.names) :]
    late = float(S[:, 0] @ wound / (S[:, 0] @ S[:, 0]))
    unseen = -reduced.taken_for((J @ lost[:, 0, :, None]).ravel())
    return replace(_estimated(change, C, x.t, middle, trial_id, clock), wound=late, unseen=unseen)


def _terms(J: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Columns (6 n, m) J_j w_j of derivatives J (n, 6, k) and weights (n, n_shapes, k), but for those that are zero."""
    shape, joint = np.nonzero(weights.any(axis=0))
    return np.asarray((J[..., joint] * weights[:, None, shape, joint]).reshape(6 * len(J), -1))


def _median(q: np.ndarray, loaded: np.ndarray) -> np.ndarray:
    """Median (k,) of each joint's preloaded readings (n, k); of all of them where it never is."""
    return np.nanmedian(np.where(loaded | ~loaded.any(axis=0), q, np.nan), axis=0)


def _estimated(  # noqa: PLR0913  the parts of one line
    change: np.ndarray, C: np.ndarray, t: np.ndarray, middle: float, trial_id: str, clock: Clock
) -> TrialLag:
    """Lag and drift at the instant where they are uncorrelated, from those at `middle` with covariance C."""
    shift = float(np.clip(-C[0, 1] / C[1, 1], t[0] - middle, t[-1] - middle))
    at = middle + shift
    s = float(clock.from_mocap(np.array([at]))[0])
    sigma = float(np.sqrt(C[0, 0] + 2 * shift * C[0, 1] + shift**2 * C[1, 1]))
    lag = Lag(at - s + float(change[0] + shift * change[1]), sigma)
    return TrialLag(trial_id, s, lag, clock.drift + float(change[1]), float(np.sqrt(C[1, 1])), float(t[-1] - t[0]))


def _residuals(T_measured: np.ndarray, T: np.ndarray) -> np.ndarray:
    """log6(T_measured^-1 T) to first order in the error, (n, 6) [m, rad]."""
    error = inverse(T_measured) @ T
    return np.concatenate([error[:, :3, 3], rotation_vector(error[:, :3, :3])], axis=1)


def _gravity_torques(hand: HandModel, q: np.ndarray) -> np.ndarray:
    """Torques (n, k) [N.m, N] that hold the chain's joints at readings q, nominal masses."""
    return hand.chain.gravity_torques(hand.angles(q))


def refined(robot: Provisional, description: Description, trials: Sequence[Trial], clock: Clock) -> list[TrialLag]:
    """Lags from poses, around the clock that a first pass by fewer samples finds.

    Raises:
        NotEnoughData: No trial moves a joint that gravity preloads.
    """
    lags: list[TrialLag] = []
    for stride in _STRIDES:
        found = refined_lags(robot, description, trials, clock, stride)
        lags = [lag for lag in found if lag.lag.sigma < _UNKNOWN]
        if not lags:
            raise NotEnoughData("no trial moves a joint that gravity preloads on one flank, or readings are too coarse")
        clock = fit_clock(clock.instrument, lags)[0]
    return lags
