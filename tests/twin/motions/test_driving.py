"""The base moves: paths, carried robots, wheels."""

from dataclasses import replace

import numpy as np
import pytest

from scenarios import load
from scenarios.files.errors import ScenarioError
from twin.campaign import laboratory, measure
from twin.config import Departures
from twin.defects import ThermalDrift
from twin.motions import RATE, BasePath, driving, schedule
from twin.simulation import kinematic_states
from twin.simulation.kinematic import in_base
from twin.transforms import rotation_vector

TRACK, RADIUS = 0.4044, 0.0985


@pytest.fixture(scope="module")
def heins():
    return load("heins2022").twin


@pytest.fixture(scope="module")
def moves(heins):
    return {m.id: m for m in driving.trials(heins.campaign)}


@pytest.fixture(scope="module")
def robot(heins):
    return laboratory(heins, 0)


def test_the_wheels_turn_by_what_the_path_asks():
    t = np.arange(0.0, 6.0, 1.0 / RATE)
    yaw = 0.8 * np.sin(t)
    way, middle = 0.2 * np.cos(0.5 * t[1:]) / RATE, 0.5 * (yaw[1:] + yaw[:-1])
    steps = way[:, None] * np.column_stack([np.cos(middle), np.sin(middle)])
    planar = np.column_stack([np.vstack([np.zeros(2), np.cumsum(steps, axis=0)]), yaw])
    left, right = BasePath(planar).wheel_angles(TRACK, RADIUS).T
    np.testing.assert_allclose((right - left) * RADIUS / TRACK, yaw - yaw[0], atol=1e-12)
    np.testing.assert_allclose(0.5 * np.diff(left + right) * RADIUS, way, atol=1e-12)


def test_the_nominal_robot_is_that_differential_drive():
    np.testing.assert_allclose(driving.differential_drive(), (TRACK, RADIUS), atol=1e-12)


def test_a_spin_and_a_drive_rest_where_they_say(moves):
    for name, rests, step in (("spin_kinematic", 12, [0.0, 0.0, np.pi / 6]), ("drive_kinematic", 9, [0.1, 0.0, 0.0])):
        motion = moves[name]
        assert len(motion.dwells) == rests and motion.dwells[0, 1] >= 1.0
        for k, (start, stop) in enumerate(motion.dwells):
            rest = motion.base.planar[round(start * RATE) + 1 : round(stop * RATE) + 1]
            np.testing.assert_allclose(rest, np.tile(k * np.array(step), (len(rest), 1)), atol=1e-12)


def test_casters_that_turn_where_they_stand_roll_in_a_drive(robot, moves):
    casters = [f"twin.base.caster_{k}.turning_force=8.0" for k in ("front", "back")]
    lab = laboratory(load("heins2022", casters).twin, 0)
    driven = [which.twin_in(moves["spin_wheels"], 0.0).model for which in (lab, robot)]
    assert driven[0].nv == driven[1].nv
    assert not any(".turn_" in driven[0].joint(j).name for j in range(driven[0].njnt))


def test_a_carried_spin_turns_about_the_base_frame_and_nothing_else_moves(robot, moves):
    states = kinematic_states(robot.twin, moves["spin_kinematic"], robot.T_lab_base)
    base, hand = states.poses["base_footprint"], states.poses["gripper_grasping_frame"]
    np.testing.assert_allclose(base[:, :3, 3], np.tile(robot.T_lab_base[:3, 3], (len(base), 1)), atol=1e-15)
    yaw = rotation_vector(np.linalg.solve(robot.T_lab_base, base))
    np.testing.assert_allclose(np.unwrap(yaw[:, 2])[-1], 11 * np.pi / 6, atol=1e-12)
    assert np.abs(yaw[:, :2]).max() < 1e-12
    in_base = np.linalg.solve(base, hand)
    np.testing.assert_allclose(in_base, np.tile(in_base[0], (len(base), 1, 1)), atol=1e-14)


def test_no_plate_feels_a_carried_robot(robot, moves):
    motion = moves["drive_kinematic"]
    trial, true = measure(robot, motion, robot.states(motion, 0.0), 50.0)
    assert trial.plate == () and len(trial.t_plate) == 0
    assert len(trial.dwell_start) == 9
    np.testing.assert_allclose(np.ptp(true.base_pose[:, 1, 3]), 0.8 * abs(np.sin(robot.config.base.pose[2])), atol=1e-9)


def test_a_carried_robot_warms_too(heins, moves):
    xi = (5e-3, 0.0, 0.0, 10e-3, 0.0, 0.0)
    lab = laboratory(
        replace(heins, departures=Departures(warming={"arm_1_joint": ThermalDrift("arm_1_joint", xi, 100.0)})), 0
    )
    motion = moves["spin_kinematic"]
    cold, warm = (lab.states(motion, time).poses for time in (0.0, 1e5))
    moved = [p["gripper_grasping_frame"][0, :3, 3] - p["base_footprint"][0, :3, 3] for p in (cold, warm)]
    hand = np.linalg.solve(lab.T_lab_base, cold["gripper_grasping_frame"][0])
    physical = [lab.twin_in(moves["spin_wheels"], time) for time in (0.0, 1e5)]
    expected = [in_base(twin, motion.command[:1], ("gripper_grasping_frame",))[0, 0] for twin in physical]
    np.testing.assert_allclose(hand, expected[0], atol=1e-12)
    shift = lab.T_lab_base[:3, :3] @ (expected[1] - expected[0])[:3, 3]
    np.testing.assert_allclose(moved[1] - moved[0], shift, atol=1e-12)
    assert np.linalg.norm(shift) > 4e-3


@pytest.fixture(scope="module")
def driven(heins):
    """A short spin and drive by the wheels, with the robot's model."""
    quick = replace(heins.campaign.driving, forms=("wheels",), spin_rests=4, drive_rests=4, yaw_rate=2.0, speed=0.2)
    short = replace(heins, campaign=replace(heins.campaign, driving=quick, dwell=0.8, rest=1.0))
    robot = laboratory(short, 0)
    return robot, {m.kind: (m, robot.states(m, 0.0)) for m in driving.trials(short.campaign)}


def rests(robot, motion, states):
    """Planar poses in the start's frame at the end of each rest, and how far the base moved in its last 0.2 s."""
    T = np.linalg.solve(robot.T_lab_base, states.poses["base_footprint"])
    last = [round(stop * 1000) - 1 for _, stop in motion.dwells]
    creep = max(np.ptp(T[k - 200 : k, :2, 3], axis=0).max() for k in last)
    return np.column_stack([T[last, :2, 3], np.unwrap(rotation_vector(T[last])[:, 2])]), creep


def test_wheels_spin_the_base_nearly_on_the_spot(driven):
    robot, trials = driven
    planar, creep = rests(robot, *trials["spin"])
    np.testing.assert_allclose(planar[:, 2], np.arange(4) * np.pi / 2, rtol=0.02, atol=2e-3)
    assert np.linalg.norm(planar[:, :2], axis=1).max() < 2e-3
    assert np.linalg.norm(planar[1:, :2] - planar[:-1, :2], axis=1).max() > 1e-6  # it does wander
    assert creep < 1e-4


def test_wheels_drive_the_base_straight(driven):
    robot, trials = driven
    planar, creep = rests(robot, *trials["drive"])
    np.testing.assert_allclose(planar[:, 0], np.arange(4) * 0.1, atol=1.5e-3)
    assert np.abs(planar[:, 1:]).max() < 3e-3
    assert creep < 1e-3


def test_the_plate_feels_a_robot_that_drives_by_itself(driven):
    robot, trials = driven
    motion, states = trials["spin"]
    trial, _ = measure(robot, motion, states, 50.0)
    assert trial.plate == ("plate",)
    weight = -9.81 * robot.twin.model.body_subtreemass[robot.twin.model.body("base_footprint").id]
    assert abs(trial.plate_wrench[:, 0, 2].mean() / weight - 1.0) < 2e-3


def test_an_anchored_base_cannot_drive():
    with pytest.raises(ScenarioError, match="cannot roll where base.wheels is 'anchored'"):
        load("heins2022", ["twin.base.wheels=anchored"])


def test_a_campaign_without_sweeps_and_swings_has_none(heins, nominal):
    short = replace(heins.campaign, calibration_postures=4, validation_postures=4)
    found = schedule(short, nominal, 0)
    assert [m.kind for m in found].count("static") == 2
    assert {m.kind for m in found} == {"static", "spin", "drive"}
