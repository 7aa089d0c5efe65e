"""Marker bodies registered again in another session; geometry, zeros and joint models stay as they were calibrated.

    minimise over T_base_B, T_tool_H     sum_i |log6(T_measured_i^-1 T_B_H(q_i))|^2 / tolerance^2        12 parameters

Asked of the dwells of the session's registration trials, which are not scored. Rows of the datasheet are not
registered. Encoders that were homed again are not fitted: their error is part of the prediction's.

A calibrated robot with remounted markers: both frames fitted to a few postures, and their covariance.

    frames = argmin sum_i |w log6(T_i^-1 T_B_H(q_i))|^2,    error of frames = -L w (J_g dg + e),    L = (w J_f)^+ w

dg ~ N(0, Sigma_g) is the error of all that stays (placements, zeros, gears), e_i the random errors of the postures'
readings and of the hand, covariance S_i, both as the calibration found them. So frames and geometry are off together:

    covariance of (frames, g) = A Sigma_g A' + (L w S w L', 0),    A = (-L w J_g, 1)

What the frames of some days differ by from the first day's is what another one may, n days of three values d each:

    s^2 = sum d^2 / (3 n - 2),    the variance of a t distribution, as so few values make it
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calibration.estimate.rows import row_of
from calibration.mocap.cluster_pose import poses_of
from calibration.mocap.labels import relabelled_trial
from calibration.mocap.postures import dwell_windows
from calibration.numerics.lie import from_vector, inverse, log6, mean
from calibration.prediction.compensator import Compensator
from calibration.prediction.predictor import Predictor
from calibration.recording.dataset import Dataset
from calibration.recording.schema import Description, TrialEntry
from calibration.recording.set_apart import REGISTRATION
from calibration.recording.trial import Trial
from calibration.robot.blocks import Frames
from calibration.robot.hand import HandModel
from calibration.robot.hand_uncertainty import Session
from calibration.stages.geometry.registration import fit_frames, frame_weights


def registration_trials(dataset: Dataset) -> tuple[TrialEntry, ...]:
    """Static trials of the confirmation session that are there for registering."""
    return tuple(e for e in dataset.entries("confirmation", "static") if e.motion == REGISTRATION)


def reregistered(predict: Predictor, dataset: Dataset) -> Predictor:
    """The same robots with both marker bodies where the confirmation session's registration trials show them.

    Raises:
        NotEnoughData: No dwell shows base and hand, or they turn about one direction only.
    """
    trials = [relabelled_trial(dataset, entry) for entry in registration_trials(dataset)]
    models = dict(predict.models)
    bundled = predict.bundled
    for name in (n for n in models if row_of(n).registered):
        models[name] = fit_frames(models[name], *_postures(predict, name, trials), predict.description)
        if bundled is not None and row_of(name).bundle:
            bundled = replace(bundled, hand=models[name])
    return replace(predict, models=models, bundled=bundled)


def changes(before: HandModel, after: HandModel) -> np.ndarray:
    """Local twists (2, 6) of base and hand marker body from one registration to another [m, rad]."""
    pairs = ((before.base, after.base), (before.hand, after.hand))
    return np.array([log6(inverse(from_vector(a)) @ from_vector(b)) for a, b in pairs])


def session_of(changed: Sequence[np.ndarray]) -> Session:
    """How far bodies may be on another day, by the changes (2, 6) that re-registrations of one day or more showed."""
    squares = np.array(changed).reshape(-1, 2, 2, 3) ** 2
    base, hand = np.sqrt(squares.sum(axis=(0, 3)) / (3 * len(squares) - 2)).tolist()
    return Session(tuple(base), tuple(hand))


def _postures(predict: Predictor, name: str, trials: Sequence[Trial]) -> tuple[np.ndarray, np.ndarray]:
    seen = [_dwells(predict, name, trial) for trial in trials]
    q, T = (np.concatenate(parts) for parts in zip(*seen, strict=True)) if seen else (np.empty(0), np.empty(0))
    return q, T


def _dwells(predict: Predictor, name: str, trial: Trial) -> tuple[np.ndarray, np.ndarray]:
    """Mean positions (n, n_joints) and measured T_B_H (n, 4, 4), unbent, of the dwells that show both bodies."""
    base, hand = predict.description.base_body, predict.description.hand_body
    q = predict.row_readings.positions(name, "motor", trial)
    T = inverse(poses_of(base, trial).T) @ poses_of(hand, trial).T
    known = np.isfinite(q).all(axis=1) & np.isfinite(T).all(axis=(1, 2))
    bundled = predict.bundled
    if (
        bundled is not None
        and predict.robot is not None
        and predict.row_readings.side(row_of(name), "motor") == "bundled"
    ):
        bends = bundled.hand_in_base(trial, predict.robot)[known] @ inverse(bundled.hand.poses(q[known]))
        T[known] = inverse(bends) @ T[known]
    inside = [known & (trial.t_mocap >= a) & (trial.t_mocap <= b) for a, b in dwell_windows(trial)]
    seen = [k for k in inside if k.any()]
    if not seen:
        return np.empty((0, q.shape[1])), np.empty((0, 4, 4))
    return np.array([q[k].mean(axis=0) for k in seen]), np.array([mean(T[k]) for k in seen])


def reregistered_compensator(
    robot: Compensator, q: np.ndarray, T_measured: np.ndarray, description: Description
) -> Compensator:
    """The robot with its marker frames fitted to static postures, its geometry and zeros fixed.

    Args:
        robot: As calibrated on another day.
        q: (n, n_joints) motor readings at rest [rad, m].
        T_measured: (n, 4, 4) T_B_H, the hand's marker body in the base's.
        description: Of the laboratory.

    Raises:
        NotEnoughData: They turn the hand about one direction only.
    """
    variance = np.broadcast_to(robot.reading_sigma**2, (len(q), len(robot.reading_sigma)))
    if robot.arm is not None and len(q):
        positions = robot.arm.at_rest(q)
        T_measured = inverse(robot.arm.bends(robot.hand, positions)) @ T_measured
        q, variance = positions.q, robot.arm.variance(robot.hand, positions, robot.reading_sigma)
    hand = fit_frames(robot.hand, q, T_measured, description)
    return replace(robot, hand=hand, covariance=_covariance(robot, hand, q, variance, frame_weights(description)))


def _covariance(robot: Compensator, hand: HandModel, q: np.ndarray, variance: np.ndarray, W: np.ndarray) -> np.ndarray:
    """(p, p) of frames and all that stays; positions q of variance (n, k), errors of postures weighed by W (6, 6)."""
    n, p = len(q), len(robot.names)
    found = hand.poses_and_derivatives(q, names=robot.names)
    frames = np.isin(robot.names, hand.block(Frames).names)
    J = (W @ found.J).reshape(6 * n, p)
    L = np.linalg.pinv(J[:, frames])
    A = np.eye(p)[:, ~frames]
    A[frames] = -L @ J[:, ~frames]
    each = (L.reshape(-1, n, 6) @ W).transpose(1, 0, 2)
    covariance = A @ robot.covariance[np.ix_(~frames, ~frames)] @ A.T
    errors = (found.J_joint * variance[:, None, :]) @ np.swapaxes(found.J_joint, 1, 2)
    errors += np.diag(robot.spread.hand_variances)
    random = (each @ errors @ each.transpose(0, 2, 1)).sum(axis=0)
    covariance[np.ix_(frames, frames)] += random
    return np.asarray(covariance)
