"""What the hand does to the floor, as the wrist's sensor shows it: it hangs on links, on a base that leans."""

import numpy as np
import pytest

import mjcf
from calibration.recording.clock import Clock
from calibration.stages.drive_trains import DriveTrain, DriveTrains
from calibration.stages.drive_trains.hung_load import HungLoad
from calibration.stages.drive_trains.torques import dynamics
from calibration.stages.stick_slip.forcing import CUTOFF, Readings
from calibration.stages.stick_slip.poses import Links
from calibration.stages.suspension.base_response import laboratory
from calibration.stages.suspension.floor_wrench import motion_load
from calibration.stages.wrist_load import expected_load
from tests.doubles import rigid_robot
from tests.doubles.moving_base import T_LAB_BASE

LINK = "wrist_ft_link"
HUNG = rigid_robot.described(wrist_link=LINK)
CLOCK = Clock("robot", 0.0, 0.0, np.zeros((2, 2)), 0.0, 1e-4)
LAB = laboratory(mjcf.urdf(), HUNG, CLOCK, None).lab
T = np.arange(0.0, 8.0, 0.01)
Q = np.array([0.1, 0.4, -0.3, 0.2, 1.1, 0.3, -0.4, 0.2])
SAG = 0.03  # [rad] of arm_5, whose gear gives where the hand pulls
G = np.array(HUNG.gravity) @ T_LAB_BASE[:3, :3]


def readings(links, tilt, a=0.0):
    """(n, 6) of the sensor on links (n, k) of a base that leans by (n, 2) [rad], accelerates by a (n, 3) [m/s2]."""
    load, turn = expected_load(LAB, LINK), np.pad(tilt, ((0, 0), (0, 1)))
    weight = load.mass * ((G - np.cross(turn, G) - a)[:, None] @ LAB.chain.poses(links, LINK)[:, :3, :3])[:, 0]
    return np.concatenate([weight, np.cross(load.centre, weight)], axis=1)


def behind(q, wrist, c):
    """The links: arm_5 winds up by c [rad/(N.m)]."""
    robot = dynamics(mjcf.urdf(), HUNG, np.zeros(8))
    train = DriveTrain("arm_5_joint", "dead_zone", np.array([0.0, c, 1e-9, 0.0, 0.0, 0.0, 0.0]), dynamic=False)
    hung = HungLoad(np.zeros(4), np.zeros(3), np.zeros((7, 7)), HUNG.payload_of(), np.zeros(4))
    trains = DriveTrains(robot, (train,), mjcf.urdf(), HUNG, hung)
    return Links(LAB, trains, Readings(T, q), T_LAB_BASE, wrist)


@pytest.mark.parametrize(("sags", "leans"), [(1.0, 0.0), (0.0, 1.0)])
def test_a_hand_weighs_downwards(sags, leans):
    """As links behind their gears have it, and upright: else a share of its weight would push the floor sideways."""
    q = np.tile(Q, (len(T), 1))
    q[:, 4] += 0.2 * np.sin(np.pi * 0.5 * T)
    tilt = leans * np.array([5e-3, -6e-3]) * np.sin(np.pi * 0.4 * T)[:, None]
    load = dynamics(mjcf.urdf(), HUNG, np.zeros(8)).loads("", T, q)
    c = sags * SAG / np.abs(load.torque[:, 5]).max()
    links = q.copy()
    links[:, 5] -= c * load.torque[:, 5]
    poses = np.tile(T_LAB_BASE, (len(T), 1, 1))
    poses[:, :3, :3] = [T_LAB_BASE[:3, :3] @ (np.eye(3) + _skew(rx, ry)) for rx, ry in tilt]
    found = behind(q, readings(links, tilt), c).load(T, poses).signal.x
    expected = motion_load(LAB, T, links, T_LAB_BASE, CUTOFF).signal.x
    rows = slice(200, 600)
    sideways = (found - expected)[rows][:, (0, 1, 5)]
    weight = expected_load(LAB, LINK).mass * 9.81
    assert np.abs(sideways).max() < 0.1 * max(SAG * sags, 6e-3 * leans) * weight


def test_a_hand_is_moved_by_a_base_that_slides():
    """Slowly, too: what is slower than 1 Hz is not all the sensor's error."""
    q, still = np.tile(Q, (len(T), 1)), np.zeros((len(T), 2))
    x = 0.1 * np.sin(2.0 * np.pi * 0.3 * T)[:, None] * [1.0, -0.5, 0.0]
    a = -((2.0 * np.pi * 0.3) ** 2) * x
    poses = np.tile(T_LAB_BASE, (len(T), 1, 1))
    poses[:, :3, 3] += x @ T_LAB_BASE[:3, :3].T
    found, rests = (
        behind(q, readings(q, still, by), 1e-9).load(T, at).signal.x
        for by, at in ((a, poses), (0.0, np.tile(T_LAB_BASE, (len(T), 1, 1))))
    )
    rows, pushes = slice(200, 600), -expected_load(LAB, LINK).mass * a[:, :2]
    error = (found - rests)[rows, :2] - pushes[rows]
    assert np.abs(error).max() < 0.1 * np.abs(pushes).max()


def _skew(rx, ry):
    return np.array([[0.0, 0.0, ry], [0.0, 0.0, -rx], [-ry, rx, 0.0]])
