"""What the motion capture and an instrument show of the same motion, trial by trial, for the lag between them.

Robot: angular velocity of the hand in the base, by markers and by the nominal chain at the readings, and its nuisance
terms; plate: the moments Mx, My of the nominal masses, moved as markers and encoders say, and those it measured.
The equations are those of `clocks`.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.side_by_side import side_by_side
from calibration.numerics.signals import Signal, body_rates, even, interpolate_columns, low_passed, play
from calibration.numerics.time_delay import Pair, coarse_lag
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain
from calibration.stages.clocks.plate_moments import Carrier, JointMotion, length, model_moments, plate_moments
from calibration.stages.clocks.pose_refinement import Provisional, link_angles

_CUTOFF = 6.0  # robot [Hz]
_HALF_GAPS = (1 / 8, 1 / 2, 3 / 2)  # of the datasheet's tolerance of backlash; a tenth of it in m if prismatic
_MOVES = 8.0  # a joint whose range exceeds this many half gaps gets that play term
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Motion:
    """What the motion capture (y) and an instrument (x) show of one trial."""

    trial_id: str
    pair: Pair


def robot_motions(description: Description, chain: Chain, trials: Sequence[Trial]) -> list[Motion]:
    """Angular velocity of the hand in the base, of every trial that shows one."""

    def shown(trial: Trial) -> Motion | None:
        try:
            T_base_hand = MeasuredTrial.of(description, trial).T_base_hand
            y = low_passed(even(*body_rates(trial.t_mocap, T_base_hand[:, :3, :3])), _CUTOFF)
            x, nuisance = _robot_rates(chain, trial, description.tolerances.joint_play)
        except NotEnoughData as error:
            _log.info("%s: %s", trial.id, error)
            return None
        return Motion(trial.id, Pair(_aligned(y, x), x, nuisance, np.zeros((len(y.t), 0, 3))))

    return [motion for motion in side_by_side(shown, trials) if motion is not None]


def _aligned(y: Signal, x: Signal) -> Signal:
    """Vectors y (n, 3) turned by the one rotation that brings it closest to x (n, 3), each on its own clock.

    The speeds alone, which need no rotation, give the lag for it. They are not compared further: noise only ever
    adds to a speed near zero, which is where backlash shows.
    """
    s = y.t - coarse_lag(length(y), length(x))
    at = interpolate_columns(s, x.t, x.x, 0.0)
    U, _, Vt = np.linalg.svd(y.x.T @ at)
    return replace(y, x=y.x @ U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt)


def _robot_rates(chain: Chain, trial: Trial, backlash: float) -> tuple[Signal, np.ndarray]:
    """Angular velocity of the tool (n, 3) [rad/s, tool] by the nominal chain, and its nuisance terms (n, k, 3)."""
    t, q = trial.t_robot, trial.q_motor[:, chain.columns]
    half_gaps = np.array([_half_gaps(chain, name, backlash) for name in chain.joints])
    joint, width = np.nonzero(np.ptp(q, axis=0)[:, None] > _MOVES * half_gaps)
    lost = play(q[:, joint], half_gaps[joint, width]) - q[:, joint]
    axes = chain.joint_jacobians(0.5 * (trial.q_motor[1:] + trial.q_motor[:-1]))[:, 3:]
    dt = np.diff(t)[:, None]
    parts = axes * (np.diff(q, axis=0) / dt)[:, None]
    before = np.cumsum(parts, axis=2) - parts
    turned = np.cross(before, axes, axis=1)[:, :, np.ptp(q, axis=0) > _MOVES * half_gaps[:, 0]]
    terms = axes[:, :, joint] * (np.diff(lost, axis=0) / dt)[:, None]
    both = np.concatenate([parts.sum(axis=2)[..., None], terms, turned], axis=2).reshape(len(parts), -1)
    signal = low_passed(even(0.5 * (t[1:] + t[:-1]), both), _CUTOFF)
    x = signal.x.reshape(len(signal.t), 3, -1)
    return replace(signal, x=x[:, :, 0]), np.swapaxes(x[:, :, 1:], 1, 2)


def _half_gaps(chain: Chain, joint: str, backlash: float) -> np.ndarray:
    return backlash * np.array(_HALF_GAPS) * (0.1 if chain.is_prismatic(joint) else 1.0)


def plate_motions(
    parts: Sequence[Carrier],
    description: Description,
    trials: Sequence[Trial],
    robot: Clock,
    model: Provisional | None,
) -> list[Motion]:
    """Moments Mx, My of the model and of the plate, of every trial; markers are noisier than plates."""

    def shown(trial: Trial) -> Motion | None:
        try:
            joints = JointMotion(robot.to_mocap(trial.t_robot), trial.q_motor)
            if model is not None:
                joints = link_angles(model, description, trial, robot)
            x, (y, nuisance) = plate_moments(trial), model_moments(parts, MeasuredTrial.of(description, trial), joints)
        except NotEnoughData as error:
            _log.info("%s: %s", trial.id, error)
            return None
        return Motion(trial.id, Pair(y, x, np.zeros((len(x.t), 0, 2)), nuisance))

    return [motion for motion in side_by_side(shown, trials) if motion is not None]
