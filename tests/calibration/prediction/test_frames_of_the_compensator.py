"""What a program on the robot needs beside poses: base from its markers, tool frame, readings in radians."""

from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration import Compensator
from calibration.errors import InputError, NotEnoughData
from calibration.numerics.lie import from_vector
from calibration.prediction.hand_pose import at_readings
from calibration.recording.clock import shared_clock
from calibration.robot.chain import chain_of
from calibration.robot.hand import nominal_hand
from tests.doubles import rigid_robot

LAB = rigid_robot.described()
FRAMES = np.array([3e-3, -2e-3, 1e-3, 0.01, 0.02, -0.01, 2e-3, 1e-3, -3e-3, 0.02, -0.03, 0.01])
BASE = rigid_robot.se3(np.array([0.9, 0.5, 0.1, 0.02, -0.01, 1.2]))


@pytest.fixture(scope="module")
def robot():
    hand = nominal_hand(chain_of(mjcf.urdf(), LAB), FRAMES)
    return Compensator(hand, (), np.zeros((0, 0)), np.zeros(8), laboratory=LAB)


def test_the_base_is_found_from_its_markers(robot):
    T_lab_B = BASE @ from_vector(FRAMES[:6])
    markers = rigid_robot.positions(np.repeat(T_lab_B[None], 20, axis=0), rigid_robot.BODIES["base"][1])
    markers[3, 1] = np.nan
    np.testing.assert_allclose(robot.base_from_markers(markers), BASE, atol=1e-9)
    with pytest.raises(NotEnoughData, match="no sample shows three"):
        robot.base_from_markers(np.full((5, 4, 3), np.nan))
    with pytest.raises(NotEnoughData, match="no three markers"):
        replace(robot, laboratory=None).base_from_markers(markers)


def test_the_tool_is_where_the_urdf_has_it(robot):
    q = rigid_robot.near_postures(np.random.default_rng(0), 3)
    expected = BASE @ robot.hand.chain.poses(q)
    np.testing.assert_allclose(robot.tool(robot.predict(np.arange(3.0), q, None, BASE)), expected, atol=1e-12)


@pytest.mark.parametrize("how", ["recording", "sample"])
def test_degrees_are_refused(robot, how):
    q = rigid_robot.near_postures(np.random.default_rng(0), 3)
    wrong = np.where(np.arange(8) > 0, np.degrees(q), q)
    with pytest.raises(InputError, match="degrees"):
        robot.predict(np.arange(3.0), wrong) if how == "recording" else robot.step(0.0, wrong[0])


def test_a_wrench_on_the_plates_clock_is_brought_to_the_readings():
    robot, plate = (
        replace(shared_clock(n), offset=o, drift=d) for n, o, d in (("robot", 3.9, 2e-5), ("plate", -2.6, 0.0))
    )
    t, wave = np.linspace(10.0, 12.0, 50), np.array([1.0, 2.0, 0.5, 3.0, 0.1, 1.0])
    t_plate = np.arange(15.0, 20.0, 1e-3)
    wrench = np.sin(plate.to_mocap(t_plate)[:, None] * wave)
    found = at_readings(t, (robot, plate), t_plate, wrench)
    np.testing.assert_allclose(found, np.sin(robot.to_mocap(t)[:, None] * wave), atol=2e-6)
    with pytest.raises(NotEnoughData, match="cut the readings"):
        at_readings(t + 3.0, (robot, plate), t_plate, wrench)
    with pytest.raises(NotEnoughData, match=r"\['plate'\] not known"):
        at_readings(t, (robot,), t_plate, wrench)
