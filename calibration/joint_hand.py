"""Whether joint corrections bring the hand nearer to where the markers saw it, judged on calibration trials.

    e = W (r - J_joint d)        r = log6(T_measured^-1 T_B_H(q_motor))   local twist of the hand [m, rad]

d are the discrepancies predicted by models of the other trials; W divides position and rotation by what the geometry
alone leaves of them. A link encoder may be worse than the gear it watches (eccentricity): what its joint's model takes
off then adds to the hand's error. The joint whose model costs most is dropped, again and again, while that helps.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from calibration.clock import Clock
from calibration.hand import HandModel
from calibration.map_fit import linearised
from calibration.markers import base_body, hand_body
from calibration.postures import read_passing
from calibration.recording import Trial
from calibration.schema import Description

_SPACING = 0.2  # [s] between the samples judged
_HELPS = 0.99  # dropping a joint must bring the cost below this share of what it was [-]

Predicted = Mapping[str, Mapping[str, tuple[np.ndarray, np.ndarray]]]
"""Joint -> trial id -> times (n,) [s, robot clock] and predicted discrepancies (n,) [rad]."""


def harmful(
    description: Description, trials: Sequence[Trial], robot: Clock, hand: HandModel, predicted: Predicted
) -> tuple[str, ...]:
    """Joints whose left-out corrections make the hand's error larger; none where no trial shows the hand."""
    e, moved = hand_errors(description, trials, robot, hand, predicted)
    kept, dropped = list(predicted), []
    while kept and len(e):
        left = e - sum(moved[joint] for joint in kept)
        cost = {joint: float(((left + moved[joint]) ** 2).sum()) for joint in kept}
        worst = min(kept, key=lambda joint: cost[joint])
        if cost[worst] >= _HELPS * float((left**2).sum()):
            break
        kept.remove(worst)
        dropped.append(worst)
    return tuple(dropped)


def hand_errors(
    description: Description, trials: Sequence[Trial], robot: Clock, hand: HandModel, predicted: Predicted
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """W r (n, 6) [-], and of every joint W J_joint d (n, 6) [-]."""
    pairs = [(trial, _corrected(trial, predicted)) for trial in trials if _is_seen(description, trial)]
    if not pairs:
        return np.zeros((0, 6)), {joint: np.zeros((0, 6)) for joint in predicted}
    raw, less = (read_passing(description, side, robot, _SPACING) for side in zip(*pairs, strict=True))
    at = linearised(hand, hand.theta, raw)
    size = np.sqrt((at.r.reshape(-1, 2, 3) ** 2).mean(axis=(0, 2)))
    W = np.repeat(1.0 / np.maximum(size, np.finfo(float).tiny), 3)
    d, chain = raw.q - less.q, hand.chain
    columns = {joint: (chain.joints.index(joint), chain.measured.index(joint)) for joint in predicted}
    return W * at.r, {joint: W * at.J_joint[:, :, j] * d[:, [q]] for joint, (j, q) in columns.items()}


def _is_seen(description: Description, trial: Trial) -> bool:
    """Whether the trial records three markers of the base and of the hand."""
    bodies = (base_body(description), hand_body(description))
    return all(sum(m.name in trial.marker for m in body.markers) >= 3 for body in bodies)


def _corrected(trial: Trial, predicted: Predicted) -> Trial:
    """The trial with the predicted discrepancies taken off its motor readings."""
    q = np.array(trial.q_motor)
    for joint, of_trials in predicted.items():
        if trial.id in of_trials:
            q[:, trial.joint.index(joint)] -= np.interp(trial.t_robot, *of_trials[trial.id])
    return replace(trial, q_motor=q)
