from dataclasses import replace

import mujoco
import numpy as np
import pytest

import mjcf
from calibration.errors import ShapeError
from calibration.stages.stick_slip.kernel.lifted import borne
from calibration.stages.stick_slip.wheels import (
    NAMES,
    PRIOR,
    SlipParameters,
    WheelSet,
    preloads,
    wheel_set,
)
from scenarios import load
from tests.calibration.stages.stick_slip.slipping import POSITION, TRUTH, WEIGHT, WHEELS
from tests.doubles.moving_base import WHEELS as DECLARED
from twin.campaign import laboratory
from twin.motions.trial_schedule import schedule
from twin.simulation.setpoints import prepare


def test_parameters_are_their_logarithms():
    assert SlipParameters.of(TRUTH.logarithms) == SlipParameters.of(SlipParameters.of(TRUTH.logarithms).logarithms)
    np.testing.assert_allclose(SlipParameters.of(PRIOR).logarithms, PRIOR)
    assert len(NAMES) == len(PRIOR) == 17
    ahead = replace(TRUTH, load_x=-2e-3, load_y=1e-3, drive_held=0.9, back_held=-0.3)
    found = SlipParameters.of(ahead.logarithms)
    np.testing.assert_allclose(found.values[-4:], [-2e-3, 1e-3, 0.9, -0.3])
    assert SlipParameters.of(ahead.logarithms[:15]) == replace(found, drive_held=0.0, back_held=0.0)


def test_the_wheels_bear_the_weight_where_it_is():
    n, G = WHEELS.loads(1.1, 0.9)
    N = n + G @ WEIGHT
    np.testing.assert_allclose([N.sum(), N @ POSITION[:, 0], N @ POSITION[:, 1]], WEIGHT)
    equal, drives, backs = (n + G @ WEIGHT for n, G in (WHEELS.loads(*s) for s in ((1.0, 1.0), (1.2, 1.0), (1.0, 1.2))))
    assert np.all(drives[:2] > equal[:2]) and np.all(drives[2:] < equal[2:])
    assert np.all(backs[4:] > equal[4:]) and np.all(backs[:2] < equal[:2])


def test_a_load_that_is_elsewhere_is_borne_there():
    """As if its moments were counted 2 mm ahead of where they are, and 3 mm to the right; wheels are not there."""
    x, y = 2e-3, -3e-3
    rows, other = WHEELS.rows(replace(TRUTH, load_x=x, load_y=y)), WHEELS.rows(TRUTH)
    N = rows[:, 6] + rows[:, 7:10] @ WEIGHT
    np.testing.assert_allclose(N, other[:, 6] + other[:, 7:10] @ (WEIGHT + WEIGHT[0] * np.array([0.0, x, y])))
    np.testing.assert_allclose(rows[:, :2], other[:, :2] - (x, y), atol=1e-12)


def test_stiffness_is_the_sum_over_wheels():
    K = WHEELS.stiffness(TRUTH)
    assert K[0, 0] == 2 * (TRUTH.drive_kx + TRUTH.front_k + TRUTH.back_k)
    assert K[1, 1] == 2 * (TRUTH.drive_ky + TRUTH.front_k + TRUTH.back_k)
    x = 0.15 * TRUTH.front_k - 0.19 * TRUTH.back_k
    np.testing.assert_allclose(K[1, 2], 2 * x)


def test_preloaded_wheels_are_in_balance_and_as_strong_as_said():
    e = preloads(WHEELS, TRUTH, WEIGHT)
    f = e * WHEELS.rows(TRUTH)[:, 2:4]
    total = np.stack([f[..., 0].sum(axis=1), f[..., 1].sum(axis=1)])
    moment = (POSITION[:, 0] * f[..., 1] - POSITION[:, 1] * f[..., 0]).sum(axis=1)
    assert np.abs(total).max() < 1e-9 and np.abs(moment).max() < 1e-9
    assert 0.5 < np.linalg.norm(f, axis=2).mean() < 2.0
    np.testing.assert_array_equal(e, preloads(WHEELS, TRUTH, WEIGHT))


def test_a_wheel_weighs_what_the_nominal_robot_says():
    found = wheel_set(mjcf.urdf(), DECLARED, 9.81)
    assert found.types.count("drive") == 2 and found.types.count("front") == 2 and found.types.count("back") == 2
    drives = found.weight[[kind == "drive" for kind in found.types]]
    np.testing.assert_allclose(drives, 4.4 * 9.81)
    assert np.all(found.weight[[kind != "drive" for kind in found.types]] < 2.0)


def test_wheels_that_would_pull_lift_off_and_the_others_bear_the_load():
    n, G = WHEELS.loads(1.0, 1.0)
    light, tipped = np.array([730.0, 20.0, 3.0]), np.array([730.0, 75.0, 20.0])
    wrenches = np.zeros((2, 6))
    wrenches[:, (2, 4, 3)] = np.array([light, tipped]) * [-1.0, 1.0, -1.0]
    found = borne(WHEELS.standing(), wrenches)
    np.testing.assert_array_equal(found[0], wrenches[0])
    assert (n + G @ tipped).min() < -20.0
    N = np.maximum(n + G @ (found[1, [2, 4, 3]] * [-1.0, 1.0, -1.0]), 0.0)
    np.testing.assert_allclose([N.sum(), N @ POSITION[:, 0], N @ POSITION[:, 1]], tipped, rtol=1e-9)
    assert (N == 0.0).any()


def test_wheels_seen_from_another_place_bear_the_same():
    off, tipped = np.array([4e-3, -7e-3]), np.zeros((1, 6))
    tipped[:, (2, 4, 3)] = np.array([730.0, 75.0, 20.0]) * [-1.0, 1.0, -1.0]
    seen = tipped.copy()
    seen[:, (4, 3)] -= tipped[:, 2:3] * off * [1.0, -1.0]
    shares = np.array([1.2, 0.9])
    true, found = borne(WHEELS.standing(shares), tipped), borne(WHEELS.standing(shares, off), seen)
    np.testing.assert_allclose(found[0, 2], true[0, 2], rtol=1e-12)
    np.testing.assert_allclose(found[0, (4, 3)] + found[0, 2] * off * [1.0, -1.0], true[0, (4, 3)], rtol=1e-9)


def test_wheels_of_a_base_that_has_slid_bear_the_load_where_they_are():
    """The plate's moments are about where it stood; the wheels are 5 mm and 0.03 rad away."""
    N, far = np.array([150.0, 170.0, 180.0, 190.0, 30.0, 20.0]), np.array([5e-3, -3e-3, 0.03])
    here = far[:2] + POSITION @ np.array([[1.0, far[2]], [-far[2], 1.0]])
    wrench, at_rest = np.zeros((1, 6)), np.zeros((1, 6))
    wrench[0, (2, 4, 3)] = -N.sum(), N @ here[:, 0], -N @ here[:, 1]
    at_rest[0, (2, 4, 3)] = -N.sum(), N @ POSITION[:, 0], -N @ POSITION[:, 1]
    found = borne(WHEELS.standing(), wrench, far[None])
    np.testing.assert_allclose(found, at_rest, atol=0.1)  # to first order in the turn: 1e-3 of 60 N.m
    assert np.abs(wrench - at_rest).max() > 3.0


def test_the_wheels_of_a_tilted_twin_bear_its_load_where_they_have_rolled():
    """MuJoCo's contacts are a spring's deflection behind the wheels' places, and as far ahead as their radius rolls."""
    lab = laboratory(load("humanoids2024").twin, 0)
    inputs = prepare(lab.twin, schedule(lab.config.campaign, mjcf.model(), 0)[0], lab.T_lab_base)
    model, data = inputs.model, mujoco.MjData(inputs.model)
    mujoco.mj_setState(model, data, inputs.first, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    data.ctrl = inputs.control[0]
    base = model.body(lab.robot.wheels[0].body_name).parentid[0]
    data.xfrc_applied[base] = [10.0, -10.0, 0.0, 20.0, 10.0, 0.0]
    mujoco.mj_step(model, data, 3000)
    R = data.xmat[base].reshape(3, 3)
    yaw = np.arctan2(R[1, 0], R[0, 0])
    upright = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    ry, rx = upright @ R[:2, 2] * (1.0, -1.0)
    touches = {int(g): c.pos[:2] for c in data.contact[: data.ncon] for g in (c.geom1, c.geom2)}
    wheels = [w for w in lab.robot.wheels if model.geom(w.contact_geom).id in touches]
    at = np.array([touches[model.geom(w.contact_geom).id] for w in wheels])
    found = (at - data.xpos[base, :2]) @ upright.T
    e = -np.array([[data.joint(f"{w.name}.{axis}").qpos[0] for axis in "xy"] for w in wheels])
    rolled = np.array([w.centre[2] - w.contact[2] for w in wheels])[:, None] * [ry, -rx]
    assert len(wheels) > 3 and np.abs(rolled).max() > 4e-4
    np.testing.assert_allclose(found, np.array([w.contact[:2] for w in wheels]) - e + rolled, atol=2e-5)


def test_wheels_of_an_estimate_without_their_radius_do_not_roll():
    bare = WheelSet(WHEELS.names, WHEELS.types, POSITION, WHEELS.weight).rows(TRUTH)
    np.testing.assert_array_equal(bare[:, :11], WHEELS.rows(TRUTH)[:, :11])
    np.testing.assert_array_equal(bare[:, 11:], 0.0)
    with pytest.raises(ShapeError, match="radius"):
        replace(WHEELS, radius=np.zeros(2))
