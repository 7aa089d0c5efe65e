"""What a plate weighs at rest, against Pinocchio's centre of mass of a robot with other masses that leans and moves."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import mjcf
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.signals import Signal
from calibration.recording.clock import Clock
from calibration.recording.schema import Payload
from calibration.robot.urdf import LinkMasses
from calibration.stages.suspension.base_response import laboratory
from calibration.stages.suspension.rest_frame import Rest, rest_of
from calibration.stages.suspension.weighing import Second, columns_of, leans, seconds_at_rest, weighed, weighed_links
from tests.doubles import rigid_robot
from tests.doubles.moving_base import WHEELS, moved

DESCRIPTION = rigid_robot.described(wheels=[w.model_dump() for w in WHEELS])
ROBOT, PLATE = (Clock(i, 0.0, 0.0, np.zeros((2, 2)), 0.0, 1e-4) for i in ("robot", "plate"))
STILL = rigid_robot.Truth(marker_sigma=1e-5, encoder_quantum=0.0, robot=(0.0, 0.0), plate=(0.0, 0.0))
LAB = laboratory(mjcf.urdf(), DESCRIPTION, ROBOT, PLATE).lab
JOINTS = tuple(LAB.floating.names)[1:]
OFF, G = np.array([4e-3, -3e-3]), 9.81
K = np.diag([8e4, 9e4, 4e5, 1.2e4, 1.6e4, 4e3])
AT_REST = Rest(np.eye(4), np.eye(4))


AT_HOME = np.zeros(6)


def load(lab, q, pose=AT_HOME):
    """(-Fz, My, -Mx) about the origin of frame 0 of a base displaced by a pose (6,): weight and centre of mass."""
    model = lab.floating
    base = pin.SE3ToXYZQUAT(pin.SE3(pin.exp3(pose[3:]), pose[:3]))
    centre = pin.centerOfMass(model, model.createData(), np.r_[base, q])
    return G * sum(body.mass for body in model.inertias) * np.append(1.0, centre[:2])


def other(rng):
    """A robot as far from the nominal one as its tolerances."""
    known = DESCRIPTION.tolerances
    share = known.link_mass * rng.normal(size=len(JOINTS))
    shift = known.link_com * rng.normal(size=(len(JOINTS), 3))
    share[0], shift[0] = 0.0, 0.0
    return replace(LAB, urdf=LinkMasses(JOINTS, share, shift).on(LAB.urdf))


def test_what_bodies_change_of_the_load_is_its_derivative():
    q, step, n = rigid_robot.CENTRE, 1e-4, len(JOINTS)
    v = load(LAB, q)
    found, nominal, height = columns_of(LAB, Second(q, v, np.zeros(3)))
    np.testing.assert_allclose(nominal, v)
    for i in (0, 3, 6, 8):
        more = LinkMasses(JOINTS, step * np.eye(n)[i], np.zeros((n, 3))).on(LAB.urdf)
        np.testing.assert_allclose(found[:, 4 * i], (load(replace(LAB, urdf=more), q) - v) / step, rtol=1e-6, atol=1e-6)
    shift = np.zeros((n, 3))
    shift[4, 1] = step
    aside = LinkMasses(JOINTS, np.zeros(n), shift).on(LAB.urdf)
    np.testing.assert_allclose(found[:, 4 * 4 + 2], (load(replace(LAB, urdf=aside), q) - v) / step, atol=1e-6)
    np.testing.assert_allclose(found[:, -2:] @ OFF, [0.0, *(v[0] * OFF)])
    tilted = load(LAB, q, np.array([0.0, 0.0, 0.0, 0.0, step, 0.0]))
    np.testing.assert_allclose(height, (tilted[1] - v[1]) / step, rtol=1e-3)


def test_a_payload_has_no_part_in_what_a_link_weighs():
    q = rigid_robot.CENTRE
    load_in_hand = Payload(link="gripper_grasping_frame", mass=0.4, com=(0.0, 0.0, 0.0), tolerance=0.0)
    heavy = replace(LAB, description=DESCRIPTION.model_copy(update={"payload": load_in_hand})).carrying(2.0)
    second = Second(q, load(heavy, q), np.zeros(3))
    found, nominal, _ = columns_of(heavy, second)
    assert second.v[0] > load(LAB, q)[0] + 19.0
    np.testing.assert_allclose(nominal, second.v)
    np.testing.assert_allclose(found[:, :-2], columns_of(LAB, second)[0][:, :-2])


@pytest.mark.parametrize("leaning", [True, False])
def test_a_base_that_leans_and_has_moved_does_not_look_like_another_robot(leaning):
    """3 mrad and 6 mm of a load of 730 N would be 5 N.m."""
    rng, seconds = np.random.default_rng(1), []
    for q in rigid_robot.random_angles(rng, 12):
        x = rng.normal(size=3) * [6e-3, 6e-3, 0.03]
        pose = np.zeros(6)
        pose[[0, 1, 5]] = x
        for _ in range(3):  # what it leans by is of the load it has so
            v = load(LAB, q, pose)
            pose[3:5] = leans(K, v)
        seconds.append((LAB, Second(q, v, x)))
    found = weighed(seconds, K if leaning else None)
    size = np.abs(found.off).max(), np.abs(found.links.share).max()
    assert size[0] < 2e-5 and size[1] < 2e-3 if leaning else size[0] > 2e-4
    np.testing.assert_allclose(found.seems, np.mean([(s.v - load(LAB, s.q))[1:] / s.v[0] for _, s in seconds], axis=0))


def test_the_load_of_other_postures_is_known_to_a_third():
    """Tolerances do not tell links apart that move alike; what they do to the floor is known."""
    rng, left = np.random.default_rng(2), []
    for _ in range(6):
        true = other(rng)
        seconds = [(LAB, Second(q, load(true, q) + [0.0, *(730.0 * OFF)], np.zeros(3)))
                   for q in rigid_robot.random_angles(rng, 20)]  # fmt: skip
        found = weighed(seconds, None)
        as_weighed = replace(LAB, urdf=found.links.on(LAB.urdf))
        new = rigid_robot.random_angles(rng, 20)
        for lab in (as_weighed, LAB):
            off = np.array([load(lab, q) - load(true, q) for q in new])[:, 1:]
            left.append(np.sqrt(((off - off.mean(axis=0)) ** 2).mean()))
        assert np.all(np.abs(found.off - OFF) < 3.0 * found.sigma)
    known, nominal = np.array(left).reshape(-1, 2).T
    assert np.median(known / nominal) < 1.0 / 3.0


@pytest.mark.parametrize("scale", [1.0, -1.0])
def test_a_plate_that_is_turned_weighs_no_links(scale):
    seconds = [(LAB, Second(q, load(LAB, q) * [1.0, scale, scale], np.zeros(3)))
               for q in rigid_robot.random_angles(np.random.default_rng(5), 20)]  # fmt: skip
    assert weighed(seconds, None).likely == (scale > 0.0)


def test_robots_within_their_tolerances_are_likely():
    rng = np.random.default_rng(6)
    for _ in range(20):
        true = other(rng)
        seconds = [(LAB, Second(q, load(true, q), np.zeros(3))) for q in rigid_robot.random_angles(rng, 20)]
        assert weighed(seconds, None).likely


def swung(at, change):
    """A trial, and a plate's wrench along it whose load swings by `change` (3,) after a time `at` [s]."""
    motor, _ = rigid_robot.through(np.repeat(rigid_robot.CENTRE[None], 2, axis=0), dwell=4.0)
    trial = rigid_robot.record(STILL, motor, 0.0, np.random.default_rng(0), plate=False)
    t = np.arange(0.0, trial.t_mocap[-1], 0.01)
    w = np.tile([0.0, 0.0, -730.0, 3.0, 5.0, 0.0], (len(t), 1))
    w += 0.1 * np.random.default_rng(0).normal(size=w.shape)
    w[:, [2, 4, 3]] += np.where(t > at, np.sin(30.0 * t), 0.0)[:, None] * change
    return MeasuredTrial.of(DESCRIPTION, trial), Signal(t, w, np.ones(len(t), dtype=bool))


def test_a_base_that_swings_is_not_at_rest():
    still, swings = (
        len(list(seconds_at_rest(trial, AT_REST, ROBOT, plate)))
        for trial, plate in (swung(4.0, np.zeros(3)), swung(4.0, np.array([0.0, 5.0, 0.0])))
    )
    assert swings == 4 and still > 8


def test_nothing_is_weighed_without_a_plate():
    trial, _ = swung(99.0, np.zeros(3))
    no_clock, clock = (laboratory(mjcf.urdf(), DESCRIPTION, ROBOT, plate) for plate in (None, PLATE))
    assert weighed_links(no_clock, [trial], None, np.zeros(8)) == (None, ())
    none = replace(trial, t_plate=np.zeros(0), plate_wrench=np.zeros((0, 1, 6)))
    assert weighed_links(clock, [none], None, np.zeros(8)) == (None, ())


def test_readings_count_from_their_zeros_and_the_base_from_where_a_trial_begins():
    """The plate is noisy: of one that is not, rounding decides which seconds are calm."""
    sources, zeros = laboratory(mjcf.urdf(), DESCRIPTION, ROBOT, PLATE), np.full(8, 0.02)
    motor, _ = rigid_robot.through(rigid_robot.random_angles(np.random.default_rng(4), 10), dwell=3.0)
    trial = rigid_robot.record(STILL, motor, 0.0, np.random.default_rng(0), plate=False)
    late, x = trial.t_mocap > 6.0, np.zeros((len(trial.t_mocap), 6))
    x[late, 0] = 5e-3
    loads, w = np.array([load(LAB, q) for q in trial.q_motor]), np.zeros((len(trial.t_robot), 6))
    loads[trial.t_robot > 6.0, 1] += 5e-3 * loads[0, 0]
    loads += np.random.default_rng(1).normal(0.0, 0.02, loads.shape)
    w[:, [2, 4, 3]] = loads * [-1.0, 1.0, -1.0]
    trial = moved(replace(trial, q_motor=trial.q_motor + zeros), x, trial.t_mocap)
    on_plate = w @ pin.SE3(rest_of(DESCRIPTION, trial, sources.T_base_B).T_lab_0).dualAction.T
    trial = replace(trial, t_plate=trial.t_robot, plate_wrench=on_plate[:, None], plate_centre=np.zeros((1, 3)))
    right, wrong = (weighed_links(sources, [trial], None, own)[0].links.share for own in (zeros, np.zeros(8)))
    np.testing.assert_allclose(right, 0.0, atol=2e-3)
    assert np.abs(wrong).max() > 2e-2
