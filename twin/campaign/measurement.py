"""What the instruments read of a simulated trial, and what was true at the motion capture's samples."""

from functools import partial

from calibration.recording import Trial
from twin.campaign.laboratory_model import EPOCH, Laboratory
from twin.fields.names import BASE
from twin.instruments.instrument import Timing
from twin.instruments.sampling import averaged, interpolate, interpolate_poses
from twin.motions.motion import Motion
from twin.motions.swings import JOINTS
from twin.random_streams import generator
from twin.simulation.states import States
from twin.truth import TruthTrial


def measure(lab: Laboratory, motion: Motion, states: States, start: float) -> tuple[Trial, TruthTrial]:
    """The recording of a trial that starts at `start` [s], and what was true."""
    timing, streams = Timing(start, start + float(states.t[-1]), EPOCH), partial(generator, lab.seed, motion.id)
    working = (i for i in lab.instruments if not (motion.kinematic and i.of_force))
    channels = {name: value for i in working for name, value in i.measure(states, timing, streams).items()}
    dwells = motion.dwells + start + lab.config.instruments.mocap.latency
    trial = Trial(id=motion.id, **channels, dwell_start=dwells[:, 0], dwell_stop=dwells[:, 1], approach=motion.approach)
    return trial, _true(lab, states, timing, trial)


def _true(lab: Laboratory, states: States, timing: Timing, trial: Trial) -> TruthTrial:
    """What was true when the frames of a trial were exposed."""
    mocap, exposed = lab.motion_capture, trial.t_mocap - lab.config.instruments.mocap.latency
    t = exposed - timing.start
    poses = {name: interpolate_poses(t, states.t, T) for name, T in states.poses.items()}
    hand = next(c for c in mocap.clusters if c.name == "gripper")
    return TruthTrial(
        joint=JOINTS,
        marker=mocap.markers,
        t_mocap=trial.t_mocap,
        q_motor_true=interpolate(t, states.t, states.motor),
        q_link_true=interpolate(t, states.t, states.link),
        base_pose=poses[BASE],
        hand_pose=poses[hand.link] @ hand.T_link_body,
        marker_position=mocap.true_positions(poses, exposed - timing.epoch),
        plate_wrench=averaged(t, states.t, states.wrench, 1.0 / mocap.rate),
    )
