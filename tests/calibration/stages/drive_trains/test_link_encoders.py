"""Link angles read by link encoders: their offset and eccentricity removed, the motor's where there is none."""

import numpy as np

import mjcf
from calibration.inference.parameters import Model, Parameter
from calibration.stages.drive_trains.column_bending import ColumnBending
from calibration.stages.drive_trains.corrected_trial import (
    CorrectedTrial,
    by_link_encoders,
    seen_by_links,
    shown_by_links,
)
from calibration.stages.drive_trains.drive_train import HARMONICS, DriveTrain, Quantity, harmonic_terms
from calibration.stages.drive_trains.drive_trains import DriveTrains, LinkAngles
from calibration.stages.drive_trains.geometry_refit import referred
from calibration.stages.drive_trains.torques import dynamics
from tests.doubles import rigid_robot
from tests.doubles.rigid_robot import Readings

JOINT, COLUMN, ERRORS = "arm_3_joint", 3, np.array([2e-3, 1.5e-3, -1e-3, 3e-4, 2e-4])


def test_offset_and_eccentricity_are_removed_where_a_link_encoder_reads():
    described, rng = rigid_robot.described(), np.random.default_rng(0)
    assert described.joint_names[COLUMN] == JOINT
    zero = 0.05 * rng.normal(size=8)
    train = DriveTrain(JOINT, "dead_zone", np.array([1e-3, 1e-4, 0.1, 0.1, 0.0, 0.0, 0.0]), link=ERRORS)
    trains = DriveTrains(dynamics(mjcf.urdf(), described, zero), (train,), mjcf.urdf(), described)
    theta = rigid_robot.random_angles(rng, 50)
    behind = theta + zero + 5e-4 * rng.normal(size=theta.shape)  # link angles by the drive trains, none exact
    read = np.full(theta.shape, np.nan)
    read[10:, COLUMN] = theta[10:, COLUMN] + ERRORS[0] + harmonic_terms(theta[10:, COLUMN]) @ ERRORS[1:]
    found = by_link_encoders(trains, CorrectedTrial(Readings(behind, read), None, None)).trial.q_motor
    np.testing.assert_allclose(found[10:, COLUMN], (theta + zero)[10:, COLUMN], atol=1e-5)  # phase off by the offset
    np.testing.assert_array_equal(found[:10], behind[:10])
    np.testing.assert_array_equal(np.delete(found, COLUMN, axis=1), np.delete(behind, COLUMN, axis=1))
    np.testing.assert_array_equal(shown_by_links(trains, read, behind), behind)  # a link does not jump
    np.testing.assert_array_equal(shown_by_links(trains, read[10:], behind[10:]), found[10:])


def test_the_geometry_is_of_angles_that_link_encoders_read_where_they_do():
    described, rng, n = rigid_robot.described(), np.random.default_rng(1), 20
    train = DriveTrain(JOINT, "dead_zone", np.zeros(7), link=np.zeros(5), residual=3e-5)
    other = DriveTrain("arm_5_joint", "dead_zone", np.zeros(7), link=np.full(5, np.nan), residual=4e-5)
    trains = DriveTrains(dynamics(mjcf.urdf(), described, np.zeros(8)), (train, other), mjcf.urdf(), described)
    q, predicted = rigid_robot.random_angles(rng, n), rng.normal(size=(n, 8))
    predicted[3] = np.nan  # a reading was lost
    read = q.copy()
    read[10:] = np.nan
    interval = np.full((n - 1, 8), 1e-6)
    of = CorrectedTrial(Readings(predicted, read), None, LinkAngles(None, None, None, interval, None))
    found = seen_by_links(trains, of)
    seen = np.delete(np.arange(10), 3)
    np.testing.assert_allclose(found.trial.q_motor[seen, COLUMN], q[seen, COLUMN])
    np.testing.assert_array_equal(found.trial.q_motor[10:], predicted[10:])
    np.testing.assert_array_equal(np.delete(found.trial.q_motor, COLUMN, axis=1), np.delete(predicted, COLUMN, axis=1))
    np.testing.assert_allclose(found.angles.variance[:9, COLUMN], 9e-10)
    np.testing.assert_array_equal(np.delete(found.angles.variance[:9], COLUMN, axis=1), 1e-6)
    np.testing.assert_array_equal(found.angles.variance[9:], 1e-6)


def test_what_a_zero_is_off_by_turns_the_phase_of_a_link_encoder_s_eccentricity():
    described, off, angle = rigid_robot.described(), 1e-3, np.linspace(-1.0, 1.0, 9)
    trains = DriveTrains(dynamics(mjcf.urdf(), described, np.zeros(8)), (), mjcf.urdf(), described)
    names = [f"encoder.{JOINT}.link.{what}" for what in ("offset", *HARMONICS)]
    own = tuple(Quantity(n, "rad", float(x), 0.0, "estimated") for n, x in zip(names, ERRORS, strict=True))
    train = DriveTrain(JOINT, "dead_zone", np.zeros(7), link=ERRORS, parameters=own)
    zero = Parameter(f"encoder.{JOINT}.motor.offset", "rad", 0.0, 0.0, off, "combined")
    found = referred(train, Model("full", (zero,)), trains).parameters
    assert found[0].sigma == off
    signs = np.array([1.0, -1.0, 1.0, -1.0])  # of the slopes by the zero
    moved = signs * np.array([q.sigma for q in found[1:]]) * np.sign(ERRORS[[2, 1, 4, 3]])
    at, there = (harmonic_terms(angle + d) @ e for d, e in ((off, ERRORS[1:]), (0.0, ERRORS[1:] + moved)))
    np.testing.assert_allclose(there, at, atol=4.0 * off**2 * np.abs(ERRORS[1:]).sum())


def test_a_column_is_no_better_known_than_the_masses_that_bend_it():
    exact = ColumnBending("torso_lift_joint", np.array([1e-4, 1e-4]), np.array([1e-9, 3e-6]))
    about_x, about_y = exact.parameters("torso_lift_link", 0.04)
    np.testing.assert_allclose([about_x.sigma, about_y.sigma], 1e4 * np.hypot([1e-5, 0.03], 0.04), rtol=1e-6)
