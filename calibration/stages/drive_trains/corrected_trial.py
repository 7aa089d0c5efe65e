"""A trial in use of the drive trains: its readings corrected, by the motors' encoders or by the links'.

by motors:  q = q_motor - e_m - delta                      zeros of the readings included
by links:   q = q_link + offset - offset_l - e_l(theta)    where a link encoder was identified
"""

from dataclasses import dataclass, replace

import numpy as np

from calibration.mocap.measured_trial import MeasuredTrial
from calibration.mocap.postures import readings_at
from calibration.numerics.signals import interpolate_columns
from calibration.recording.clock import Clock
from calibration.recording.trial import Trial
from calibration.robot.hand import HandModel
from calibration.stages.drive_trains.column_bending import ColumnBending, bent
from calibration.stages.drive_trains.drive_train import harmonic_terms
from calibration.stages.drive_trains.drive_trains import DriveTrains, LinkAngles
from calibration.stages.drive_trains.stage import MovedBase, loads_of_trial
from calibration.stages.drive_trains.torques import LinkLoads


@dataclass(frozen=True)
class CorrectedTrial:
    """A trial with its readings corrected.

    Attributes:
        trial: The recording; `q_motor` are link angles, NaN where a reading was.
        loads: That corrected them.
        angles: The link angles with their intervals, at the loads' times.
    """

    trial: Trial
    loads: LinkLoads
    angles: LinkAngles


def corrected_trial(
    trains: DriveTrains, trial: Trial, robot: Clock, hand: HandModel, moved: MovedBase | None = None
) -> CorrectedTrial:
    """A trial with link angles in place of its motor readings; the base as of `loads_of_trial`."""
    return by_loads(trains, trial, loads_of_trial(trains, trial, robot, hand, moved))


def by_loads(trains: DriveTrains, trial: Trial, loads: LinkLoads) -> CorrectedTrial:
    """The same by loads that are known."""
    angles = trains.of_loads(loads)
    q = np.full(trial.q_motor.shape, np.nan)
    q[np.isfinite(trial.q_motor).all(axis=1)] = angles.q
    return CorrectedTrial(MeasuredTrial.of(trains.description, trial).with_readings(q), loads, angles)


def by_link_encoders(trains: DriveTrains, corrected: CorrectedTrial) -> CorrectedTrial:
    """The trial with link angles read by the link encoders where they have one and were identified."""
    q = read_at_links(trains, corrected.trial.q_link, corrected.trial.q_motor)
    return replace(corrected, trial=replace(corrected.trial, q_motor=q))


def read_at_links(trains: DriveTrains, q_link: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Link angles (n, k) by readings q_link (n, k) of link encoders that were identified; q (n, k) where none reads.

    q = q_link + offset - offset_l - e_l(theta)            offset the zero of the motor's readings
    """
    found, known = q.copy(), np.isfinite(q).all(axis=1)
    for train in (train for train in trains.trains if np.isfinite(train.link).all()):
        j = trains.joints.index(train.joint)
        read = known & np.isfinite(q_link[:, j])
        angle = q_link[read, j] - train.link[0]
        found[read, j] = angle + trains.dynamics.offset[j] - harmonic_terms(angle) @ train.link[1:]
    return found


def shown_by_links(trains: DriveTrains, q_link: np.ndarray, q: np.ndarray) -> np.ndarray:
    """The same by encoders of which no reading is missing: a link's angle that jumps from one to the other accelerates.

    In a jolt a link accelerates by a third otherwise than its drive train predicts, arm_1's above all.
    """
    return read_at_links(trains, np.where(np.isfinite(q_link).all(axis=0), q_link, np.nan), q)


def seen_by_links(trains: DriveTrains, corrected: CorrectedTrial) -> CorrectedTrial:
    """The trial by its link encoders, as uncertain as what is left where the side of the mesh is certain."""
    one = by_link_encoders(trains, corrected)
    least = trains.by_joint(np.array([train.residual**2 for train in trains.trains]))
    rows = np.isfinite(one.trial.q_motor).all(axis=1)
    read = have_link_encoders(trains) & np.isfinite(one.trial.q_link[rows])
    return replace(one, angles=one.angles._replace(variance=np.where(read, least, one.angles.variance)))


def have_link_encoders(trains: DriveTrains) -> np.ndarray:
    """Of which joints (n_joints,) the link encoders' errors were identified."""
    return trains.by_joint(np.array([float(np.isfinite(train.link).all()) for train in trains.trains])) > 0.0


def hand_poses(hand: HandModel, bending: ColumnBending, corrected: CorrectedTrial, robot: Clock) -> np.ndarray:
    """T_B_H (n, 4, 4) at the trial's mocap times, NaN where it has no readings."""
    trial = corrected.trial
    q = readings_at(trial, robot, trial.t_mocap, trial.q_motor)
    moment = moments(corrected, robot, trial.t_mocap)
    known = np.isfinite(q).all(axis=1)
    T = np.full((len(q), 4, 4), np.nan)
    T[known] = bent(hand, bending, q[known], moment[known])
    return T


def moments(corrected: CorrectedTrial, robot: Clock, t: np.ndarray) -> np.ndarray:
    """Moments (n, 2) of the column at mocap times (n,)."""
    return interpolate_columns(robot.from_mocap(t), corrected.loads.t, corrected.angles.moment)
