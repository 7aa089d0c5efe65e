"""The robot's clock once more, from whole poses, a provisional geometry and the joints that gravity holds.

    r(t) = log6(T_measured(t)^-1 T_B_H(q(t - lag)))
         = d_lag sum_loaded J_j dq_j + c + sum_loaded J_j (o_j + a_j q_j + b_j tau_j + h_j sgn(dq_j))
                                         + sum_others d_j J_j dq_j + noise

Behind a gear the link is not where the motor is, and a gear without load lags by 4 gap / (pi amplitude omega): ten
milliseconds and more. So only joints whose gravity torque tau_j keeps its sign throughout a trial, which stay on one
flank, speak of the clock; zeros, elasticity and dry friction of theirs are nuisances. Each other joint has a lag of its
own and random errors as large as any gear's. The remaining noise is the markers' and each joint's random reading error,
by its lever arm. Static postures depend on the clock so little that milliseconds do not matter to the geometry.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d

from calibration.bodies import BodyPoses, poses_of
from calibration.clock import Clock, TrialLag
from calibration.errors import NotEnoughData
from calibration.hand import HandModel, nominal_hand
from calibration.hand_fit import fit
from calibration.inverse_dynamics import JointMotion
from calibration.lag import Lag, long_run_variance
from calibration.markers import base_body, hand_body
from calibration.parameters import geometry_parameters, play_floor, play_start
from calibration.postures import read_postures
from calibration.recording import Trial
from calibration.robot import Chain
from calibration.schema import Description
from calibration.se3 import adjoint, inverse, rotation_vector

_STRIDE = 2  # motion-capture samples
_ENOUGH = 100  # samples
_MOVES = 0.05  # [rad, m] a joint must move to count as moving
_LOADED, _TORQUE = 0.1, 0.3  # a joint is loaded while |tau| exceeds this share of its largest, and this [N.m, N]
_JERK, _AFTER = 3.0, 0.3  # samples within _AFTER [s] of faster accelerations [rad/s2, m/s2] are left out: links bounce
_SLOW = 0.02  # [rad/s, m/s] below which dry friction has no sign
_FREE = 0.02  # [rad, m] random error of a joint that is not loaded: more than any gear's play
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Provisional:
    """A robot good enough to compare clocks by.

    Attributes:
        hand: Calibrated on the static postures.
        play: (k,) random reading error of each joint [rad, m].
        largest: (k,) largest gravity torque of each joint in the campaign [N.m, N].
    """

    hand: HandModel
    play: np.ndarray
    largest: np.ndarray


@dataclass(frozen=True)
class Samples:
    """One trial on the motion capture's clock, where base and hand are seen.

    Attributes:
        t: (n,) [s].
        q: (n, n_measured) readings [rad, m].
        v: (n, k) rates of the chain's joints [rad/s, m/s].
        T: (n, 4, 4) measured T_B_H.
        covariance: (n, 6, 6) of its local twist [m, rad].
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    T: np.ndarray
    covariance: np.ndarray


def provisional(chain: Chain, description: Description, trials: Sequence[Trial], robot: Clock) -> Provisional:
    """Calibrate on the static postures with an approximate clock.

    Raises:
        NotEnoughData: No static posture, or a fit that does not converge.
    """
    parameters = geometry_parameters(chain, description)
    nominal = nominal_hand(chain, parameters.nominal[:12])
    postures = read_postures(description, trials, robot)
    start, floor = play_start(chain, description), play_floor(chain, description)
    found = fit(nominal, parameters, postures, start, floor)
    if not found.converged:
        raise NotEnoughData("the provisional geometry did not converge")
    hand = nominal.with_theta(found.theta)
    some = np.concatenate([trial.q_motor[:: max(1, len(trial.t_robot) // 200)] for trial in trials])
    return Provisional(hand, found.play, np.abs(_gravity_torques(hand, some)).max(axis=0))


def refined_lags(robot: Provisional, description: Description, trials: Sequence[Trial], clock: Clock) -> list[TrialLag]:
    """Lags of the trials that move loaded joints, around an approximate clock."""
    lags = []
    for trial in trials:
        try:
            lags.append(_refined(robot, _samples(description, trial, clock, calm=True), trial.id, clock))
        except NotEnoughData as error:
            _log.info("%s: %s", trial.id, error)
    return lags


def link_angles(robot: Provisional, description: Description, trial: Trial, clock: Clock) -> JointMotion:
    """Joint angles behind the gears: readings, less their zeros, moved by what the hand's pose shows.

        e = -D J' (S + J D J')^-1 r,     D = diag(play^2)

    Joints that are not on the way to the hand keep their readings.
    """
    x = _samples(description, trial, clock, calm=False)
    J, D = robot.hand.joint_jacobians(x.q), robot.play**2
    r = _residuals(x.T, robot.hand.poses(x.q))
    C = x.covariance + (J * D) @ np.swapaxes(J, 1, 2)
    q = robot.hand.angles(x.q)
    q[:, robot.hand.chain.columns] -= D * np.einsum("nik,ni->nk", J, np.linalg.solve(C, r[..., None])[..., 0])
    return JointMotion(x.t, q)


def _samples(description: Description, trial: Trial, clock: Clock, calm: bool) -> Samples:
    """Every other sample, without jerky motion if only `calm` ones are wanted."""
    base, hand = poses_of(base_body(description), trial), poses_of(hand_body(description), trial)
    s, T = clock.from_mocap(trial.t_mocap), inverse(base.T) @ hand.T

    def at(x: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(s, trial.t_robot, c, left=np.nan, right=np.nan) for c in x.T], axis=1)

    rates = np.gradient(trial.q_motor, trial.t_robot, axis=0)
    jerked = np.abs(np.gradient(rates, trial.t_robot, axis=0)).max(axis=1) > _JERK
    near = maximum_filter1d(jerked.astype(float), 2 * int(_AFTER / np.median(np.diff(trial.t_robot))) + 1)
    q, v, wanted = at(trial.q_motor), at(rates), (at(near[:, None])[:, 0] == 0.0) | (not calm)
    rows = np.flatnonzero(wanted & np.isfinite(q).all(axis=1) & np.isfinite(T).all(axis=(1, 2)))[::_STRIDE]
    if len(rows) < _ENOUGH:
        raise NotEnoughData("base and hand are hardly in view, or all motion is jerky")
    return Samples(trial.t_mocap[rows], q[rows], v[rows], T[rows], _covariances(T, base, hand, rows, description))


def _covariances(
    T: np.ndarray, base: BodyPoses, hand: BodyPoses, rows: np.ndarray, description: Description
) -> np.ndarray:
    Ad = adjoint(inverse(T[rows]))
    C = hand.covariance[rows] + Ad @ base.covariance[rows] @ np.swapaxes(Ad, 1, 2)
    return description.sigmas.marker**2 * C


def _refined(robot: Provisional, x: Samples, trial_id: str, clock: Clock) -> TrialLag:
    """Least squares for the lag with the nuisances eliminated, its sigma allowing for autocorrelation."""
    hand, columns = robot.hand, robot.hand.chain.columns
    v, tau = x.v[:, columns], _gravity_torques(hand, x.q)
    loaded = np.abs(tau).min(axis=0) > np.maximum(_TORQUE, _LOADED * robot.largest)
    moves = np.ptp(x.q[:, columns], axis=0) > _MOVES
    if not (loaded & moves).any():
        raise NotEnoughData("no joint moves that gravity holds on one flank")
    J = hand.joint_jacobians(x.q)
    moved = J * np.where(loaded, robot.play, np.maximum(robot.play, _FREE))
    W = np.linalg.inv(np.linalg.cholesky(x.covariance + moved @ np.swapaxes(moved, 1, 2)))
    J = W @ J
    shapes = (np.ones_like(v), x.q[:, columns] - x.q[:, columns].mean(axis=0), tau, np.tanh(v / _SLOW))
    held = [(J * shape[:, None])[:, :, loaded & moves] for shape in shapes]
    A = np.concatenate([W, *held, (J * v[:, None])[:, :, ~loaded]], axis=2).reshape(6 * len(v), -1)
    slope = (J * v[:, None])[:, :, loaded].sum(axis=2)
    r = W @ _residuals(x.T, hand.poses(x.q))[..., None]
    y = _orthogonal_to(A, np.column_stack([r.ravel(), slope.ravel()]))
    information = float(y[:, 1] @ y[:, 1])
    change = float(y[:, 0] @ y[:, 1]) / information
    psi = (y[:, 1] * (y[:, 0] - change * y[:, 1]) / information).reshape(-1, 6).sum(axis=1)
    sigma = float(np.sqrt(long_run_variance(psi, 1.0 / float(np.median(np.diff(x.t))))))
    middle = float(np.average(x.t, weights=(y[:, 1] ** 2).reshape(-1, 6).sum(axis=1)))
    s = float(clock.from_mocap(np.array([middle]))[0])
    return TrialLag(trial_id, s, Lag(middle - s + change, sigma, 1.0))


def _orthogonal_to(A: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Columns y without what the columns of A explain."""
    A = A / np.maximum(np.linalg.norm(A, axis=0), np.finfo(float).tiny)
    return y - A @ np.linalg.lstsq(A, y, rcond=1e-8)[0]


def _residuals(T_measured: np.ndarray, T: np.ndarray) -> np.ndarray:
    """log6(T_measured^-1 T) to first order in the error, (n, 6) [m, rad]."""
    error = inverse(T_measured) @ T
    return np.concatenate([error[:, :3, 3], rotation_vector(error[:, :3, :3])], axis=1)


def _gravity_torques(hand: HandModel, q: np.ndarray) -> np.ndarray:
    """Torques (n, k) [N.m, N] that hold the chain's joints at readings q, nominal masses."""
    return hand.chain.gravity_torques(hand.angles(q))


def refined(
    robot: Provisional, description: Description, trials: Sequence[Trial], clock: Clock, passes: int = 2
) -> list[TrialLag]:
    """Lags from poses; each pass starts from the one before, shifted by its median.

    Raises:
        NotEnoughData: No trial moves a joint that gravity holds.
    """
    lags: list[TrialLag] = []
    for _ in range(passes):
        lags = refined_lags(robot, description, trials, clock)
        if not lags:
            raise NotEnoughData("no trial moves a joint that gravity holds on one flank")
        off = [t.lag.value - clock.offset - clock.drift * t.s for t in lags]
        clock = replace(clock, offset=clock.offset + float(np.median(off)))
    return lags
