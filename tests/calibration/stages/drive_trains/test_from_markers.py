"""A joint without a link encoder as the hand's markers show it; robots on which nothing moves."""

from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration.errors import NotEnoughData
from calibration.recording.clock import shared_clock
from calibration.robot.chain import chain_of
from calibration.robot.hand import HandModel, nominal_hand
from calibration.stages.drive_trains import from_markers
from calibration.stages.drive_trains.column_bending import rigid
from calibration.stages.drive_trains.drive_train import DriveTrain
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.drive_trains.from_markers import completed, identified_by_markers, seen_joint
from calibration.stages.drive_trains.stage import loads_of_trial
from calibration.stages.drive_trains.torques import dynamics
from tests.doubles import rigid_robot

COLUMN, JOINT = 6, "arm_6_joint"
GAP = 4e-3  # [rad]


@pytest.fixture(scope="module")
def hand() -> HandModel:
    return nominal_hand(chain_of(mjcf.urdf(), rigid_robot.described()), np.zeros(12))


@pytest.fixture(scope="module")
def trains() -> DriveTrains:
    described = rigid_robot.described()
    return DriveTrains(dynamics(mjcf.urdf(), described, np.zeros(8)), (), mjcf.urdf(), described)


@pytest.fixture(scope="module")
def trial():
    half_gap = np.zeros(8)
    half_gap[COLUMN] = 0.5 * GAP
    truth = replace(rigid_robot.Truth(), half_gap=half_gap, robot=(0.0, 0.0), marker_sigma=2e-5)
    found = rigid_robot.record(truth, rigid_robot.sweep(COLUMN, 0.5, 4.0), 0.0, np.random.default_rng(0), plate=False)
    return rigid_robot.without_plate(found)


def difference(trains: DriveTrains, trial, hand: HandModel) -> tuple[np.ndarray, np.ndarray]:
    """Motor less joint angle by markers, and its standard deviation, while the motor moves."""
    clock = shared_clock("robot")
    loads = loads_of_trial(trains, trial, clock, hand)
    seen = seen_joint(trains, loads, trial, clock, hand, rigid("torso_lift_joint"), JOINT)
    moves = np.abs(loads.v[:, COLUMN]) > 0.3
    return seen.y[moves] * np.sign(loads.v[moves, COLUMN]), np.sqrt(seen.variance[moves])


def test_the_markers_show_a_gap_s_sides(trains, trial, hand):
    sides, sigma = difference(trains, trial, hand)
    assert np.nanmean(sides) == pytest.approx(0.5 * GAP, rel=0.05)
    assert np.nanstd(sides) < 3.0 * np.median(sigma)


def test_joints_whose_drive_trains_are_known_are_no_noise_for_others(trains, trial, hand):
    known = tuple(
        DriveTrain(joint, "dead_zone", np.zeros(7), dynamic=False) for joint in rigid_robot.JOINTS[1:] if joint != JOINT
    )
    sides, sigma = difference(replace(trains, trains=known), trial, hand)
    assert np.nanmean(sides) == pytest.approx(0.5 * GAP, rel=0.05)
    assert np.median(sigma) < 0.5 * np.median(difference(trains, trial, hand)[1])


def test_recordings_without_motion_show_no_drive_train(trains, hand):
    with pytest.raises(NotEnoughData):
        completed(hand.chain, [], shared_clock("robot"), hand, trains)


def test_the_torque_is_that_of_links_as_the_markers_show_them(trains, trial, hand, monkeypatch):
    clock, used = shared_clock("robot"), []

    def data(loads, seen, column, modes, window):
        used.append((loads[0], seen[0].y))
        raise NotEnoughData("enough of it")

    monkeypatch.setattr(from_markers, "_data", data)
    loads = loads_of_trial(trains, trial, clock, hand)
    with pytest.raises(NotEnoughData, match="enough of it"):
        identified_by_markers(trains, JOINT, [trial], [loads], clock, hand, rigid("torso_lift_joint"))
    ((found, y),) = used
    delta = np.zeros(loads.q.shape)
    delta[:, COLUMN] = np.nan_to_num(y - np.nanmedian(y))
    np.testing.assert_allclose(found.torque, loads.behind(delta).torque, atol=1e-12)
    assert np.abs(found.torque - loads.torque).max() > 1e-3
