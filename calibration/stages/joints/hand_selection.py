"""Which joints to correct, and by which degree: what brings the hand nearest to where the markers saw it.

    e = W (r - sum_joints J_joint d)        r = log6(T_measured^-1 T_B_H(q_motor))    local twist of the hand [m, rad]

Judged on calibration trials; d are discrepancies predicted by models that have not seen the trial. W divides position
and rotation by what the geometry alone leaves of them. From no correction at all, the change of one joint's degree that
lowers |e|^2 most is made, again and again, while it lowers it by a hundredth. A link encoder may be worse than the gear
it watches (eccentricity): what its joint's model takes off then adds to the hand's error, and the joint stays as read.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from calibration.mocap.measured_trial import MeasuredTrial
from calibration.mocap.postures import Postures, passing_postures
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.hand import HandModel
from calibration.stages.geometry.hand_residual import linearised
from calibration.stages.joints.degree_selection import Candidate
from calibration.stages.joints.samples import Samples

_SPACING = 0.2  # [s] between the samples judged
_HELPS = 0.99  # a change must bring |e|^2 below this share of what it was [-]

Options = Mapping[str, Sequence[Candidate]]
"""Joint -> degrees worth trying, each with its left-out predictions of the joint's samples."""


def nearest_hand(
    description: Description,
    trials: Sequence[Trial],
    robot: Clock,
    hand: HandModel,
    samples: Mapping[str, Sequence[Samples]],
    options: Options,
) -> dict[str, Candidate]:
    """Degree of every joint that is to be corrected; the lowest option of each where no trial shows the hand."""
    seen = [trial for trial in trials if _is_seen(description, trial)]
    if not seen:
        return {joint: found[0] for joint, found in options.items() if found}
    raw = passing_postures(description, seen, robot, _SPACING)
    at = linearised(hand, hand.theta, raw, hand.names)
    size = np.sqrt((at.r.reshape(-1, 2, 3) ** 2).mean(axis=(0, 2)))
    W = np.repeat(1.0 / np.maximum(size, np.finfo(float).tiny), 3)
    moved: dict[tuple[str, int], np.ndarray] = {}
    for layer in range(max(map(len, options.values()), default=0)):
        present = {joint: found[layer] for joint, found in options.items() if layer < len(found)}
        d = _predicted(description, seen, robot, raw, samples, present)
        for joint in present:
            column = hand.chain.joints.index(joint)
            moved[joint, layer] = W * at.B[:, :, column] * d[:, [hand.chain.measured.index(joint)]]
    return {joint: options[joint][layer] for joint, layer in _descend(W * at.r, moved)}


def _descend(r: np.ndarray, moved: Mapping[tuple[str, int], np.ndarray]) -> list[tuple[str, int]]:
    """Choices, at most one of each joint, that bring |r - sum of what they move|^2 down, one change at a time."""
    chosen: dict[str, int] = {}
    cost = float((r**2).sum())
    while True:
        trials = []
        for joint, layer in moved:
            other = {k: v for k, v in chosen.items() if k != joint}
            trials += [other, other | {joint: layer}]
        costs = [float(((r - sum((moved[k] for k in t.items()), np.zeros(1))) ** 2).sum()) for t in trials]
        if not costs or min(costs) >= _HELPS * cost:
            return [key for key in moved if chosen.get(key[0]) == key[1]]
        cost, chosen = min(costs), trials[int(np.argmin(costs))]


def _predicted(
    description: Description,
    trials: Sequence[Trial],
    robot: Clock,
    raw: Postures,
    samples: Mapping[str, Sequence[Samples]],
    chosen: Mapping[str, Candidate],
) -> np.ndarray:
    """Left-out predictions d (n, n_measured) [rad] at the postures `raw` that were passed through."""
    less = []
    for trial in trials:
        q = np.array(trial.q_motor)
        for joint, candidate in chosen.items():
            for s, d in zip(samples[joint], candidate.left_out, strict=True):
                if s.trial_id == trial.id:
                    q[:, trial.joint.index(joint)] -= np.interp(trial.t_robot, s.t, d)
        less.append(MeasuredTrial.of(description, trial).with_readings(q))
    return raw.q - passing_postures(description, less, robot, _SPACING).q


def _is_seen(description: Description, trial: Trial) -> bool:
    """Whether the trial records three markers of the base and of the hand."""
    bodies = (description.base_body, description.hand_body)
    return all(sum(m.name in trial.marker for m in body.markers) >= 3 for body in bodies)
