"""How uncertain a corrected angle is: within the loads its drive train was found by, and beyond them."""

from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration.prediction.bundled_arm import ArmPositions, BundledArm
from calibration.robot.chain import chain_of
from calibration.robot.hand import nominal_hand
from calibration.stages.drive_trains.column_bending import ColumnBending
from calibration.stages.drive_trains.drive_train import DriveTrain, Quantity
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.drive_trains.torques import dynamics
from tests.doubles import rigid_robot

JOINT, COLUMN, OWN, SIGMA = "arm_3_joint", 3, 1e-10, 2e-5  # OWN [rad2] of the side, SIGMA [rad/(N.m)]
TORQUES = np.array([-9.0, -4.0, 0.0, 3.0, 8.0])
COMPLIANCE = Quantity(f"gear.{JOINT}.compliance", "rad/(N.m)", 1e-4, SIGMA, "estimated")
DESCRIBED = rigid_robot.described()
HAND = nominal_hand(chain_of(mjcf.urdf(), DESCRIBED), np.zeros(12))


def arm(bending=None, **changes):
    train = replace(DriveTrain(JOINT, "dead_zone", np.zeros(7), parameters=(COMPLIANCE,)), **changes)
    trains = DriveTrains(dynamics(mjcf.urdf(), DESCRIBED, np.zeros(8)), (train,), mjcf.urdf(), DESCRIBED)
    return BundledArm(trains, bending or ColumnBending("torso_lift_joint", np.zeros(2), np.zeros(2)), np.zeros(8))


def positions(moment=(0.0, 0.0)):
    shape = (len(TORQUES), 8)
    q, torque = np.tile(rigid_robot.CENTRE, (len(TORQUES), 1)), np.zeros(shape)
    torque[:, COLUMN] = TORQUES
    return ArmPositions(q, np.full(shape, OWN), np.tile(moment, (len(q), 1)), torque, np.zeros(shape, dtype=bool))


@pytest.mark.parametrize(
    ("changes", "beyond"),
    [
        ({"range": np.array([-5.0, 4.0])}, [4.0, 0.0, 0.0, 0.0, 4.0]),
        ({}, np.abs(TORQUES)),  # not known: all of the load
        ({"range": np.array([-5.0, 4.0]), "form": "friction_held"}, np.zeros(5)),  # what trials left out says it
    ],
)
def test_a_compliance_errs_beyond_the_loads_it_was_found_by(changes, beyond):
    found = arm(**changes).variance(HAND, positions(), np.full(8, 3e-5))
    np.testing.assert_allclose(found[:, COLUMN], OWN + (SIGMA * np.array(beyond)) ** 2 + 9e-10)
    np.testing.assert_allclose(np.delete(found, COLUMN, axis=1), 9e-10)  # of readings without a drive train


def test_a_column_errs_beyond_the_moment_that_the_geometry_took_up():
    bending = ColumnBending("torso_lift_joint", np.full(2, 1e-4), np.array([1e-6, 2e-6]), np.array([1.0, -40.0]))
    of, T = arm(bending), np.tile(np.eye(4), (len(TORQUES), 1, 1))
    np.testing.assert_allclose(of.column_covariance(HAND, positions((1.0, -40.0)), T), 0.0, atol=1e-30)
    turned = of.column_covariance(HAND, positions((1.0, -30.0)), T)
    assert np.trace(turned[0, 3:, 3:]) == pytest.approx((2e-6 * 10.0) ** 2)
