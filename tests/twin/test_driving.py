"""The base moves: paths, carried robots, wheels."""

from dataclasses import replace

import numpy as np
import pytest

from scenarios import load
from twin import driving, schedule
from twin.base_path import BasePath
from twin.campaign import _states, laboratory, measure  # noqa: PLC2701
from twin.conventions import rotation_vector
from twin.kinematic import carried
from twin.motions import RATE

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


def test_the_wheels_speeds_integrate_to_the_path():
    t = np.arange(0.0, 6.0, 1.0 / RATE)
    yaw = 0.8 * np.sin(t)
    v = 0.2 * np.cos(0.5 * t)
    steps = np.column_stack([v * np.cos(yaw), v * np.sin(yaw)])[:-1] / RATE
    planar = np.column_stack([np.vstack([np.zeros(2), np.cumsum(steps, axis=0)]), yaw])
    left, right = BasePath("wheels", planar).wheel_speeds(RATE, TRACK, RADIUS).T
    turned = yaw[0] + np.cumsum((right - left)[:-1] * RADIUS / TRACK) / RATE
    np.testing.assert_allclose(turned, yaw[1:], atol=1e-12)
    way = 0.5 * (left + right)[:-1] * RADIUS / RATE
    end = (way[:, None] * np.column_stack([np.cos(yaw), np.sin(yaw)])[:-1]).sum(axis=0)
    np.testing.assert_allclose(end, planar[-1, :2], atol=1e-12)


def test_a_spin_and_a_drive_rest_where_they_say(moves):
    for name, rests, step in (("spin_kinematic", 12, [0.0, 0.0, np.pi / 6]), ("drive_kinematic", 9, [0.1, 0.0, 0.0])):
        motion = moves[name]
        assert len(motion.dwells) == rests and motion.dwells[0, 1] >= 1.0
        for k, (start, stop) in enumerate(motion.dwells):
            rest = motion.base.planar[round(start * RATE) + 1 : round(stop * RATE) + 1]
            np.testing.assert_allclose(rest, np.tile(k * np.array(step), (len(rest), 1)), atol=1e-12)


def test_a_carried_spin_turns_about_the_base_frame_and_nothing_else_moves(robot, moves):
    states = carried(robot.twin, moves["spin_kinematic"], robot.T_lab_base)
    base, hand = states.poses["base_footprint"], states.poses["gripper_grasping_frame"]
    np.testing.assert_allclose(base[:, :3, 3], np.tile(robot.T_lab_base[:3, 3], (len(base), 1)), atol=1e-15)
    yaw = rotation_vector(np.linalg.solve(robot.T_lab_base, base))
    np.testing.assert_allclose(np.unwrap(yaw[:, 2])[-1], 11 * np.pi / 6, atol=1e-12)
    assert np.abs(yaw[:, :2]).max() < 1e-12
    in_base = np.linalg.solve(base, hand)
    np.testing.assert_allclose(in_base, np.tile(in_base[0], (len(base), 1, 1)), atol=1e-14)


def test_no_plate_feels_a_carried_robot(robot, moves):
    motion = moves["drive_kinematic"]
    trial, true = measure(robot, motion, _states(robot, motion, 0.0), 50.0)
    assert trial.plate == () and len(trial.t_plate) == 0
    assert len(trial.dwell_start) == 9
    np.testing.assert_allclose(np.ptp(true.base_pose[:, 1, 3]), 0.8 * abs(np.sin(robot.config.base.pose[2])), atol=1e-9)


def test_a_campaign_without_sweeps_and_swings_has_none(heins, nominal):
    short = replace(heins.campaign, calibration_postures=4, validation_postures=4)
    found = schedule.schedule(short, nominal, 0)
    assert [m.kind for m in found].count("static") == 2
    assert {m.kind for m in found} == {"static", "spin", "drive"}
