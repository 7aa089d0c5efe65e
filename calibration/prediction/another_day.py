"""An estimate in a session recorded later: clocks of that day, marker bodies registered again where that is asked.

    frames = argmin sum_i |w log6((Q_i^-1 T_i)^-1 T_B_H(q_i))|^2

T_i (4, 4) the hand's marker body in the base's at a posture, q_i the positions the row's geometry is evaluated at, Q_i
the column's bending. Placements, zeros, gears and base stay as they were calibrated: what was homed or changed since is
part of the error. Covariances of the frames: `second_session`.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from calibration.errors import NotEnoughData
from calibration.estimate.drawings import redrawn
from calibration.estimate.estimate import Estimate
from calibration.estimate.rows import row_of
from calibration.inference.parameters import Model
from calibration.mocap.cluster_pose import poses_of, poses_of_means
from calibration.mocap.labels import relabelled_trial, relabelled_trials
from calibration.mocap.postures import dwell_windows
from calibration.numerics.lie import inverse, mean
from calibration.prediction.compensator import Compensator
from calibration.prediction.predict import predictor
from calibration.prediction.predictor import Predictor
from calibration.prediction.second_session import registration_trials, reregistered_compensator
from calibration.recording.dataset import Dataset, load
from calibration.recording.schema import Role, TrialEntry
from calibration.recording.set_apart import set_apart
from calibration.robot.hand_uncertainty import predicted_points
from calibration.robot.laboratory import Laboratory
from calibration.stages.clocks.stage import synchronise
from calibration.verdict import Verdict

_INSIDE = 0.75  # share of the markers in a 95 % band, by half a dozen postures whose errors are alike
_ROLES: tuple[Role, ...] = ("validation", "confirmation")


def on_another_day(estimate: Estimate, folder: Path, register: int = 0) -> Estimate:
    """The estimate for the dataset folder of a session recorded later.

    Its marker bodies are registered with the first `register` static postures, which become trials of their own there.

    Clocks are found from base and hand markers; where those do not show them, none is known: poses can be predicted on
    the robot's clock, and not compared.

    Raises:
        NotEnoughData: There are not as many and one more, they turn the hand about one direction only, or one marker
            shows no pose.
    """
    dataset = set_apart(folder, register) if register else load(folder)
    trials = tuple(trial for role in _ROLES for _, trial in relabelled_trials(dataset, role))
    try:
        clocks = synchronise(Laboratory(dataset.urdf, dataset.description), trials)[0] if trials else ()
    except NotEnoughData:
        clocks = ()
    estimate, _ = redrawn(estimate, dataset.description)
    today = replace(estimate, clocks=clocks, laboratory=dataset.description.alone)
    postures = registration_trials(dataset)
    if not postures:
        return today
    if dataset.description.hand_body.is_point or dataset.description.base_body.is_point:
        raise NotEnoughData("one or two markers on a body show no pose to register it with; put three on it")
    predict, models, verdicts = predictor(today, dataset), [], list(today.verdicts)
    for model in today.models:
        if model.name in predict.models and row_of(model.name).registered:
            again, verdict = _registered(today, model, predict, dataset, postures)
            verdicts += [verdict] if model.name == today.main else []
            models.append(again)
        else:
            models.append(model)
    return replace(today, models=tuple(models), verdicts=tuple(verdicts))


def _registered(
    estimate: Estimate, model: Model, predict: Predictor, dataset: Dataset, entries: tuple[TrialEntry, ...]
) -> tuple[Model, Verdict]:
    """The model with both marker frames fitted to the postures of these trials, and what that changed."""
    robot = Compensator.of(replace(estimate, main=model.name))
    seen = [pair for entry in entries for pair in _postures(robot, model.name, predict, dataset, entry)]
    if len(seen) < 2:
        raise NotEnoughData(f"{len(seen)} registration postures show base and hand; set more apart")
    q, T = (np.array(x) for x in zip(*seen, strict=True))
    again = reregistered_compensator(robot, q, T, dataset.description)
    values = dict(zip(again.hand.names, again.hand.theta, strict=True))
    sigma = dict(zip(again.names, np.sqrt(np.diag(again.covariance)), strict=True))
    names, covariance = [p.name for p in model.parameters], model.covariance.copy()
    known = [name for name in again.names if name in names]
    mine, theirs = [names.index(n) for n in known], [again.names.index(n) for n in known]
    covariance[np.ix_(mine, mine)] = again.covariance[np.ix_(theirs, theirs)]
    parameters = tuple(
        replace(p, value=float(values[p.name]), sigma=float(sigma[p.name])) if p.name in known else p
        for p in model.parameters
    )
    moved = _moved(robot, again, q, T, np.array([m.xyz for m in dataset.description.hand_body.markers]))
    return replace(model, parameters=parameters, covariance=covariance, combinations=()), moved


def _moved(before: Compensator, after: Compensator, q: np.ndarray, T: np.ndarray, xyz: np.ndarray) -> Verdict:
    """Whether the hand's markers xyz (m, 3) at poses T (n, 4, 4) are where the first day's frames have them."""
    p = np.einsum("nij,mj->nmi", T[:, :3, :3], xyz) + T[:, None, :3, 3]
    found = [predicted_points(robot.hand, robot.spread, xyz, q) for robot in (before, after)]
    off, left = (np.linalg.norm(f.positions - p, axis=2) for f in found)
    inside = float((off <= found[0].radius_95).mean())
    message = (
        f"the hand's markers at {len(q)} postures are {_rms_mm(off):.2f} mm rms from where the first day has them, "
        f"{inside:.0%} in its band; {_rms_mm(left):.2f} mm with both marker bodies registered again"
    )
    if inside >= _INSIDE:
        message += "; if they were not touched, do not register them: a few postures find them less exactly"
    return Verdict("registration", "ok", message)


def _rms_mm(distance: np.ndarray) -> float:
    return 1e3 * float(np.sqrt((distance**2).mean()))


def _postures(
    robot: Compensator, name: str, predict: Predictor, dataset: Dataset, entry: TrialEntry
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Positions (n_joints,) and T_B_H (4, 4), the bending taken off, of each posture that shows both bodies."""
    base, hand = dataset.description.base_body, dataset.description.hand_body
    if dataset.has_means(entry):
        means = dataset.read_means(entry)
        q, T = means.q_motor, inverse(poses_of_means(base, means).T) @ poses_of_means(hand, means).T
        groups = [np.array([k]) for k in range(len(means))]
        if robot.arm is not None:
            positions = robot.arm.at_rest(q)
            q, T = positions.q, inverse(robot.arm.bends(robot.hand, positions)) @ T
    else:
        trial = relabelled_trial(dataset, entry)
        q, T = (
            predict.row_readings.positions(name, "motor", trial),
            inverse(poses_of(base, trial).T) @ poses_of(hand, trial).T,
        )
        groups = [np.flatnonzero((trial.t_mocap >= a) & (trial.t_mocap <= b)) for a, b in dwell_windows(trial)]
        if robot.arm is not None and predict.bundled is not None and predict.robot is not None:
            bent = predict.bundled.hand_in_base(trial, predict.robot)
            T = robot.hand.poses(q) @ inverse(bent) @ T
    known = np.isfinite(q).all(axis=1) & np.isfinite(T).all(axis=(1, 2))
    for rows in (g[known[g]] for g in groups):
        if len(rows):
            yield q[rows].mean(axis=0), mean(T[rows])
