"""Link angles read by link encoders: their offset and eccentricity removed, the motor's where there is none."""

from dataclasses import dataclass

import numpy as np

import mjcf
from calibration.stages.drive_trains.drive_train import DriveTrain, harmonic_terms
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.drive_trains.geometry_refit import CorrectedTrial, by_link_encoders
from calibration.stages.drive_trains.torques import dynamics
from tests.doubles import rigid_robot

JOINT, COLUMN, ERRORS = "arm_3_joint", 3, np.array([2e-3, 1.5e-3, -1e-3, 3e-4, 2e-4])


@dataclass(frozen=True)
class Readings:
    """Of a trial, both sides."""

    q_motor: np.ndarray
    q_link: np.ndarray


def test_offset_and_eccentricity_are_removed_where_a_link_encoder_reads():
    described, rng = rigid_robot.described(), np.random.default_rng(0)
    assert described.joint_names[COLUMN] == JOINT
    zero = 0.05 * rng.normal(size=8)
    train = DriveTrain(JOINT, "dead_zone", np.array([1e-3, 1e-4, 0.1, 0.1, 0.0, 0.0, 0.0]), link=ERRORS)
    trains = DriveTrains(dynamics(mjcf.urdf(), described, zero), (train,), np.zeros(8), mjcf.urdf(), described)
    theta = rigid_robot.random_angles(rng, 50)
    behind = theta + zero + 5e-4 * rng.normal(size=theta.shape)  # link angles by the drive trains, none exact
    read = np.full(theta.shape, np.nan)
    read[10:, COLUMN] = theta[10:, COLUMN] + ERRORS[0] + harmonic_terms(theta[10:, COLUMN]) @ ERRORS[1:]
    found = by_link_encoders(trains, CorrectedTrial(Readings(behind, read), None, None)).trial.q_motor
    np.testing.assert_allclose(found[10:, COLUMN], (theta + zero)[10:, COLUMN], atol=1e-5)  # phase off by the offset
    np.testing.assert_array_equal(found[:10], behind[:10])
    np.testing.assert_array_equal(np.delete(found, COLUMN, axis=1), np.delete(behind, COLUMN, axis=1))
