"""What the wrist's sensor shows of a push at the hand, and what it does to the joints."""

import numpy as np
import pinocchio as pin
import pytest

import mjcf
from calibration.robot.laboratory import Laboratory
from calibration.robot.wrist_sensor import hand_push, hung_bodies, smoothed, wrist_sensor
from calibration.stages.drive_trains.torques import dynamics
from calibration.stages.suspension.floor_wrench import motion_load, root_in_base
from calibration.stages.wrist_load import expected_load
from tests.doubles import rigid_robot

LINK = "wrist_ft_link"
T = np.arange(0.0, 4.0, 0.01)
HUNG = rigid_robot.described(wrist_link=LINK)
LAB = Laboratory(mjcf.urdf(), HUNG)
Q = np.array([0.1, 0.4, -0.3, 0.2, 1.1, 0.3, -0.4, 0.2])


def readings(force):
    """The arm at Q, the sensor pushed by a force (3,) [N, its axes] from 2 to 3 s at 0.1 m from its origin."""
    q = np.tile(Q, (len(T), 1))
    load = expected_load(LAB, LINK)
    weight = load.mass * LAB.chain.poses(q, LINK)[:, :3, :3].swapaxes(1, 2) @ np.array(HUNG.gravity)
    w = np.concatenate([weight, np.cross(load.centre, weight)], axis=1) + [3.0, -1.0, 2.0, 0.1, 0.2, 0.0]
    outside = np.where(
        ((T >= 2.0) & (T < 3.0))[:, None], np.concatenate([force, np.cross([0.0, 0.0, 0.1], force)]), 0.0
    )
    return q, w + outside, outside


def test_a_push_is_the_reading_less_the_weight_and_loads_the_joints_by_its_power():
    q, w, outside = readings(np.array([5.0, -18.0, 7.0]))
    push = hand_push(LAB.urdf, HUNG, T, q, w)
    robot = dynamics(LAB.urdf, HUNG, np.zeros(8))
    bare, loaded = (robot.loads("", T, q, push=p).torque for p in (None, push))
    h, sensor = 1e-6, LAB.chain.poses(q[:1], LINK)[0]
    for j in range(8):
        step = np.zeros(8)
        step[j] = h
        there = np.linalg.inv(sensor) @ LAB.chain.poses(q[:1] + step, LINK)[0]
        turn = np.array([there[2, 1], there[0, 2], there[1, 0]])
        power = outside[250] @ np.concatenate([there[:3, 3], turn]) / h
        assert loaded[250, j] - bare[250, j] == pytest.approx(-power, abs=2e-3)
    np.testing.assert_allclose(loaded[:150], bare[:150], atol=1e-5)


def hung():
    """Inertia of all beyond the sensor, in its axes."""
    model = pin.buildModelFromXML(LAB.urdf)
    data, sensor = model.createData(), model.getFrameId(LINK)
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    return data.oMf[sensor].actInv(sum(hung_bodies(model, data, sensor), pin.Inertia.Zero()))


@pytest.mark.parametrize("j", [1, 3, 4, 6])
def test_what_hangs_on_the_sensor_does_not_hold_a_link_in_its_gap_back_twice(j):
    """The motors stand and a link does not: by the readings its load is that of its own motion, pushed."""
    q, w, _ = readings(np.array([5.0, -18.0, 7.0]))
    a = 10.0 * np.sin(4.0 * np.pi * T) * (T > 1.0)  # [rad/s2], a motion too small to change anything else
    step = 1e-6 * np.eye(8)[j]
    moved = np.linalg.inv(LAB.chain.poses(Q[None], LINK)[0]) @ LAB.chain.poses(Q[None] + step, LINK)[0]
    twist = np.array([*moved[:3, 3], moved[2, 1], moved[0, 2], moved[1, 0]]) / 1e-6
    seen = w - a[:, None] * (hung() * pin.Motion(twist)).vector
    robot = dynamics(LAB.urdf, HUNG, np.zeros(8))
    bare, pushed, held = (
        robot.loads("", T, q, push=p) for p in (None, *(hand_push(LAB.urdf, HUNG, T, q, x) for x in (w, seen)))
    )
    rows = slice(120, 380)
    own = pushed.torque[:, j] + bare.inertia[:, j, j] * a
    np.testing.assert_allclose((held.torque[:, j] + held.inertia[:, j, j] * a)[rows], own[rows], atol=0.02)


def shaken(hertz):
    """The base's acceleration (n, 6) [m/s2, rad/s2, root's axes], and what a hand at Q does to the sensor by it."""
    a = np.outer(np.sin(2.0 * np.pi * hertz * T) * (T > 1.0), [0.5, -0.3, 0.0, 0.0, 0.0, 2.0])
    T_root_sensor = root_in_base(LAB.floating, HUNG).inverse() * pin.SE3(LAB.chain.poses(Q[None], LINK)[0])
    return a, -a @ T_root_sensor.inverse().action.T @ hung().matrix().T


def test_a_base_that_accelerates_under_a_pushed_hand_loads_the_joints_once():
    q, w, _ = readings(np.array([5.0, -18.0, 7.0]))
    a, seen = shaken(2.0)
    robot = dynamics(LAB.urdf, HUNG, np.zeros(8))
    still, a = np.tile(robot.root(None), (len(T), 1)), np.hstack([0.0 * a, a])
    at_rest, moving = (robot.loads("", T, q, base=still + x).torque for x in (0.0, a))
    pushed = robot.loads("", T, q, push=hand_push(LAB.urdf, HUNG, T, q, w)).torque - at_rest
    both = robot.loads("", T, q, base=still + a, push=hand_push(LAB.urdf, HUNG, T, q, w + seen)).torque
    rows = slice(120, 380)
    np.testing.assert_allclose((both - moving)[rows], pushed[rows], atol=0.02)


@pytest.mark.parametrize(("hertz", "known", "share"), [(4.0, False, 1.0), (0.2, False, 0.0), (0.2, True, 1.0)])
def test_a_hand_acts_on_the_floor_as_the_sensor_shows_it_to_move(hertz, known, share):
    """What is slow is taken for masses and drift, but what a base does of which it is known how it moves."""
    q, w, _ = readings(np.zeros(3))
    a, seen = shaken(hertz)
    sensor, base = (
        wrist_sensor(LAB.urdf, HUNG),
        dynamics(LAB.urdf, HUNG, np.zeros(8)).root(None) + np.hstack([0.0 * a, a]),
    )
    hand = sensor.hand(T, smoothed(T, q, w + seen), sensor.tree, base if known else None)
    nominal, moved = (motion_load(LAB, T, q, np.eye(4), 20.0, push).signal.x for push in (None, hand))
    acts = seen @ pin.SE3(LAB.chain.poses(Q[None], LINK)[0]).dualAction.T
    rows = slice(150, 350)
    off = (moved - nominal)[rows] - share * acts[rows]
    assert (np.abs(off).max(axis=0) < 0.15 * np.abs(acts).max()).all()
    assert not hand.outside and hand_push(LAB.urdf, HUNG, T[:50], q[:50], w[:50]) is None


def test_a_hand_on_a_base_that_turns_is_thrown_outwards():
    """A base that turns at 0.3 Hz, by its twist and its acceleration: the sensor alone would take it for drift."""
    q, w, _ = readings(np.zeros(3))
    base, turns = np.tile(dynamics(LAB.urdf, HUNG, np.zeros(8)).root(None), (len(T), 1)), 0.6 * np.pi
    base[:, 5], base[:, 11] = 2.0 * np.sin(turns * T), 2.0 * turns * np.cos(turns * T)
    T_base_sensor = pin.SE3(LAB.chain.poses(Q[None], LINK)[0])
    V = (root_in_base(LAB.floating, HUNG).inverse() * T_base_sensor).actInv(pin.Motion(np.eye(6)[5]))
    thrown = -np.outer(base[:, 5] ** 2, V.cross(hung() * V).vector)
    seen, sensor = thrown - np.outer(base[:, 11], (hung() * V).vector), wrist_sensor(LAB.urdf, HUNG)
    hands = (
        sensor.hand(T, smoothed(T, q, w + seen), sensor.tree, base),
        sensor.hand(T, smoothed(T, q, w), sensor.tree),
    )
    moved, still = (motion_load(LAB, T, q, np.eye(4), 20.0, hand).signal.x for hand in hands)
    acts, rows = seen @ T_base_sensor.dualAction.T, slice(120, 380)
    np.testing.assert_allclose((moved - still)[rows], acts[rows], atol=0.05)
    assert np.abs(thrown[rows]).max() > 1.0  # [N]


def test_a_small_force_is_no_push_and_without_a_sensor_there_is_none():
    q, w, _ = readings(np.array([0.0, 0.0, 5.0]))  # what encoder zeros and tolerances of masses amount to
    assert hand_push(LAB.urdf, HUNG, T, q, w) is None
    assert hand_push(LAB.urdf, HUNG.model_copy(update={"wrist_link": None}), T, q, 10.0 * w) is None
    assert hand_push(LAB.urdf, HUNG, T, q, np.full_like(w, np.nan)) is None
