from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import mjcf
from calibration.numerics.signals import CUTOFF, Signal
from calibration.recording.clock import Clock
from calibration.stages.stick_slip.forcing import Tilting, Wrenches
from calibration.stages.stick_slip.kernel.bases import HEAVE
from calibration.stages.stick_slip.measured import slid
from calibration.stages.stick_slip.standing import (
    Read,
    _rocked,
    plate_place,
    prior_by_tilt,
    tilting_of,
    vertical_stiffness,
)
from calibration.stages.stick_slip.wheels import WIDE, WheelSet, wheel_set
from calibration.stages.suspension.base_response import base_response_of, laboratory
from calibration.stages.suspension.compliance_fit import fit_compliance
from calibration.stages.suspension.cross_validation import HeldOut
from calibration.stages.suspension.floor_wrench import Load, vertical
from calibration.stages.suspension.model import Suspension
from calibration.stages.suspension.rest_frame import Rest, rest_of
from tests.calibration.stages.stick_slip.slipping import POSITION
from tests.calibration.stages.stick_slip.slipping import WHEELS as SLIPPING
from tests.doubles import rigid_robot
from tests.doubles.moving_base import T_LAB_BASE, WHEELS, moved

DESCRIPTION = rigid_robot.described(wheels=[w.model_dump() for w in WHEELS])
ROBOT, PLATE = (Clock(i, 0.0, 0.0, np.zeros((2, 2)), 0.0, 1e-4) for i in ("robot", "plate"))
STILL = rigid_robot.Truth(marker_sigma=1e-5, encoder_quantum=0.0, robot=(0.0, 0.0), plate=(0.0, 0.0))
OFF = np.array([4e-3, -3e-3])
G = 9.81
REST = Rest(np.eye(4), np.eye(4))
SPRINGS = np.array([2.0e5, 2.0e5, 0.9e5, 0.9e5, 0.6e5, 0.6e5])  # [N/m] of WHEELS: stiff drives, so casters bear little


def robot(masses=None):
    """The whole robot, its carried links heavier by `masses` (n,) [-]."""
    model = rigid_robot.model(STILL, pin.JointModelFreeFlyer())
    for i in range(2, model.njoints):
        model.inertias[i] = pin.Inertia(
            model.inertias[i].mass * (1.0 + (0.0 if masses is None else masses[i - 2])),
            model.inertias[i].lever, model.inertias[i].inertia,
        )  # fmt: skip
    return model


def load(model, q):
    """(-Fz, My, -Mx) (n, 3) about the base's origin at postures q (n, 8)."""
    data, base = model.createData(), np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    weight = G * sum(body.mass for body in model.inertias)
    return np.array([weight * np.append(1.0, pin.centerOfMass(model, data, np.r_[base, own])[:2]) for own in q])


def signal(t, vertical):
    w = np.zeros((len(t), 6))
    w[:, (2, 4, 3)] = vertical * [-1.0, 1.0, -1.0]
    return Load(Signal(t, w, np.ones(len(t), dtype=bool)), np.zeros((6, 6)), 0.0, np.zeros(3), np.eye(4))


def stood(postures, masses, off, start=0.0):
    """A trial that dwells in postures of a robot with other masses, and its wrenches; the plate seems `off`."""
    motor, _ = rigid_robot.through(postures, dwell=3.0)
    trial = rigid_robot.record(STILL, motor, start, np.random.default_rng(0), plate=False)
    t = trial.t_robot
    plate, nominal = (load(robot(m), trial.q_motor) for m in (masses, None))
    plate[:, 1:] += plate[:, :1] * off
    wheels = wheel_set(mjcf.urdf(), DESCRIPTION.wheels, G)
    loads = signal(t, plate), signal(t, nominal)
    return trial, Wrenches("a", float(t[0]), *loads, np.zeros(0), np.zeros((0, 6, 6)), wheels)


def test_postures_tell_what_the_links_weigh_from_where_the_plate_is():
    """Links 15 % off at most."""
    rng = np.random.default_rng(3)
    masses = np.array([0.0, 0.1, 0.15, 0.12, 0.1, 0.1, 0.1, 0.1])
    sources = laboratory(mjcf.urdf(), DESCRIPTION, ROBOT, PLATE)
    postures = rigid_robot.random_angles(rng, 12)
    trial, wrench = stood(postures, masses, OFF)
    many, known, _ = plate_place(sources, [Read(trial, REST, wrench)], None)
    trial, wrench = stood(np.repeat(postures[:1], 12, axis=0), masses, OFF)
    one, unknown, _ = plate_place(sources, [Read(trial, REST, wrench)], None)
    assert np.linalg.norm(many - OFF) < 0.7e-3
    assert np.linalg.norm(one - OFF) > 2e-3
    assert np.all(np.abs(many - OFF) < 2.0 * known) and np.all(known < unknown)
    assert np.all(np.abs(one - OFF) < 3.0 * unknown)


def test_a_plate_in_its_place_and_nominal_links_leave_nothing():
    sources = laboratory(mjcf.urdf(), DESCRIPTION, ROBOT, PLATE)
    trial, wrench = stood(rigid_robot.random_angles(np.random.default_rng(3), 4), None, np.zeros(2))
    np.testing.assert_allclose(plate_place(sources, [Read(trial, REST, wrench)], None)[0], 0.0, atol=1e-5)
    np.testing.assert_array_equal(
        plate_place(sources, [Read(trial, REST, replace(wrench, dynamics=None))], None)[0], 0.0
    )
    trial, wrench = stood(rigid_robot.random_angles(np.random.default_rng(3), 4), None, OFF)
    np.testing.assert_allclose(plate_place(sources, [Read(trial, REST, wrench)], None)[2], OFF, atol=1e-5)


def test_seconds_in_which_a_joint_moves_do_not_count():
    """Loads that are wrong while the arm swings, and right before, leave nothing."""
    sources = laboratory(mjcf.urdf(), DESCRIPTION, ROBOT, PLATE)
    motor = rigid_robot.swing(np.full(8, 0.2), np.full(8, 0.5), 6.0)
    trial = rigid_robot.record(STILL, motor, 0.0, np.random.default_rng(0), plate=False)
    u, wheels = load(robot(), trial.q_motor), wheel_set(mjcf.urdf(), DESCRIPTION.wheels, G)
    moves = np.abs(trial.q_motor - trial.q_motor[0]).max(axis=1) > 1e-3
    t, none = trial.t_robot, np.zeros((0, 6, 6))
    loads = signal(t, u + moves[:, None] * [5.0, 20.0, -20.0]), signal(t, u)
    wrench = Wrenches("a", 0.0, *loads, np.zeros(0), none, wheels)
    assert 0.3 < moves.mean() < 0.95
    np.testing.assert_allclose(plate_place(sources, [Read(trial, REST, wrench)], None)[0], 0.0, atol=1e-5)


PLANE = 1e5  # [N/m, N.m/rad]


def pressed(wheels, p):
    """Compression d (3,) of a floor that pulls at no wheel, N_i = w_i + k_i a_i d or 0, under loads p (n, 3)."""
    a, found = np.column_stack([np.ones(len(SPRINGS)), wheels.position]), []
    own = 0.8 * wheels.weight
    for load in p:
        touches = np.ones(len(SPRINGS), dtype=bool)
        for _ in range(10):
            b, k = a[touches], SPRINGS[touches]
            d = np.linalg.solve(b.T @ (k[:, None] * b), load - b.T @ own[touches])
            touches = own + SPRINGS * (a @ d) > 0.0
        found.append(d)
    return np.array(found)


def rocked(wheels, amplitude, far, rng, off=(0.0, 0.0)):
    """A trial of a base that rocks on SPRINGS, a share of the seconds with casters off the floor, and slides `far`.

    The wheels are `off` [m] of where the base's markers have them: loads and heave are about another origin.
    """
    motor = rigid_robot.swing(np.zeros(8), np.full(8, 0.3), 12.0)
    trial = rigid_robot.record(STILL, motor, 0.0, rng, plate=False)
    t = trial.t_plate
    f, phase = rng.uniform(0.2, 0.5, 3), rng.uniform(0.0, 6.0, 3)
    swing = (np.sin(2.0 * np.pi * f * (t[:, None] - 1.0) + phase) - np.sin(phase)) * np.clip(t[:, None] - 1.0, 0.0, 1.0)
    p = np.array([730.0, 5.0, 0.0]) + swing * amplitude * [60.0, 40.0, 25.0]
    d = pressed(wheels, p)
    x, w = np.zeros((len(t), 6)), np.zeros((len(t), 6))
    x[:, 2:5] = (d - d[0]) * [-1.0, 1.0, -1.0]
    x[:, 2:5] = x[:, (2, 4, 3)]
    slides = np.clip(t[:, None] - 2.0, 0.0, 1.0) * far
    yaw, (pitching, rolling) = slides[:, 2], p[:, 1:].T
    w[:, (0, 1, 5)], w[:, 2] = 20.0 * swing * amplitude, -p[:, 0]
    w[:, 4] = pitching - yaw * rolling + p[:, 0] * slides[:, 0]
    w[:, 3] = -(rolling + yaw * pitching + p[:, 0] * slides[:, 1])
    w[:, 4], w[:, 3] = w[:, 4] + p[:, 0] * off[0], w[:, 3] - p[:, 0] * off[1]
    x[:, 2] += x[:, 4] * off[0] - x[:, 3] * off[1]
    x[:, (0, 1, 5)] = w[:, (0, 1, 5)] / PLANE + slides
    in_lab = w @ pin.SE3(T_LAB_BASE).dualAction.T
    return replace(moved(trial, x, t), plate_wrench=in_lab[:, None])


def on_springs(K, C, tried):
    return Suspension("compliance", K, C, np.zeros((6, 6)), np.zeros((6, 6)), (("plate", tried),), (), ())


def swings(amplitude, far=(0.0, 0.0, 0.0), seen_to_slide=True, off=(0.0, 0.0)):
    """Four trials as read, their loads, and the suspension as fitted with springs that pull."""
    sources, rng = laboratory(mjcf.urdf(), DESCRIPTION, ROBOT, PLATE), np.random.default_rng(2)
    wheels = wheel_set(mjcf.urdf(), DESCRIPTION.wheels, G)
    trials = [replace(rocked(wheels, amplitude, np.array(far), rng, off), id=name) for name in "abcd"]
    rests = [rest_of(DESCRIPTION, trial, sources.T_base_B) for trial in trials]
    loads = [sources.plate_load(trial, rest.T_lab_0) for trial, rest in zip(trials, rests, strict=True)]
    seen = [base_response_of(DESCRIPTION, *one) for one in zip(trials, rests, loads, strict=True)]
    in_plane = np.isin(np.arange(6), (0, 1, 5))
    linear = fit_compliance(seen, np.equal.outer(in_plane, in_plane))
    sums = np.ones((4, 6))
    tried = HeldOut(1e-2 * sums, sums, 1e-6 * sums, np.full(4, 1e3))
    suspension = on_springs(linear.K, linear.C, tried)
    slides = [slid(DESCRIPTION, *one, suspension) for one in zip(trials, rests, loads, strict=True)]
    slides, none = slides if seen_to_slide else [None] * len(loads), (np.zeros(0), np.zeros((0, 6, 6)), wheels)
    wrenches = [Wrenches("a", 0.0, load, None, *none, slid=own) for load, own in zip(loads, slides, strict=True)]
    return [Read(*one) for one in zip(trials, rests, wrenches, strict=True)], loads, suspension


def rocking(*how, **more):
    """K as fitted with springs that pull, what `tilting_of` has, and the springs' own K, of `swings`."""
    (read, _, suspension), wheels = swings(*how, **more), wheel_set(mjcf.urdf(), DESCRIPTION.wheels, G)
    sources = laboratory(mjcf.urdf(), DESCRIPTION, ROBOT, PLATE)
    a = np.column_stack([np.ones(len(SPRINGS)), wheels.position[:, 1], -wheels.position[:, 0]])
    return suspension.K, tilting_of(sources, read, wheels, suspension)[0], a.T @ (SPRINGS[:, None] * a)


def test_heave_that_a_whole_trial_shares_counts_as_its_reference_is_noisy():
    read, loads, suspension = swings(0.85)
    one, standing = _rocked(DESCRIPTION, read[:1], loads[:1])[0], np.zeros((0, 10))
    lower = one._replace(seen=replace(one.seen, x=one.seen.x + np.array([0.0, 0.0, 1e-4, 0.0, 0.0, 0.0])))
    before, after = (each.left(np.ones(3), suspension.K, suspension.C, standing) for each in (one, lower))
    n, m = one.seen.valid.sum(), 2.0 * CUTOFF
    np.testing.assert_allclose(((before - after) ** 2).sum(), 1e-8 / (1.0 / n + 1.0 / (100.0 * m)))


def test_casters_that_lift_off_do_not_make_the_base_softer():
    linear, found, springs = rocking(0.85)
    assert linear[4, 4] < 0.8 * springs[2, 2]
    np.testing.assert_allclose(np.diag(found.K)[3:5], np.diag(springs)[1:], rtol=0.02)
    np.testing.assert_array_equal(found.K[[0, 1, 5]], linear[[0, 1, 5]])
    np.testing.assert_allclose(found.shares, SPRINGS[[0, 4]] / SPRINGS[2], rtol=0.01)  # when they lift off tells


def test_casters_that_lift_off_show_where_the_wheels_are():
    _, found, springs = rocking(0.85, off=(4e-3, -2e-3))
    np.testing.assert_allclose(found.off, [4e-3, -2e-3], atol=5e-4)
    np.testing.assert_allclose(found.shares, SPRINGS[[0, 4]] / SPRINGS[2], rtol=0.01)
    np.testing.assert_allclose(np.diag(found.K)[3:5], np.diag(springs)[1:], rtol=0.03)
    np.testing.assert_allclose(found.over - found.off, 0.0, atol=1e-12)  # there is no other robot to compare it with


def test_a_load_of_inverse_dynamics_is_where_the_wheels_bear_it():
    x = np.tile([10.0, 20.0, -700.0, 4.0, -3.0, 2.0], (3, 1))
    load = Load(Signal(np.arange(3.0), x, np.ones(3, dtype=bool)), np.zeros((6, 6)), 730.0, np.zeros(3), np.eye(4))
    moved = Tilting(np.eye(6), np.eye(6), over=np.array([2e-3, -1e-3])).placed(load).signal.x
    np.testing.assert_allclose(vertical(moved)[0], vertical(x)[0] - 700.0 * np.array([0.0, 2e-3, -1e-3]))
    np.testing.assert_array_equal(moved[:, [0, 1, 2, 5]], x[:, [0, 1, 2, 5]])


def test_inverse_dynamics_turn_a_base_about_where_its_markers_have_it():
    x = np.tile([10.0, 20.0, -700.0, 4.0, -3.0, 2.0], (3, 1))
    load = Load(Signal(np.arange(3.0), x, np.ones(3, dtype=bool)), np.zeros((6, 6)), 730.0, np.zeros(3), np.eye(4))
    moved = Tilting(np.eye(6), np.eye(6), off=np.array([2e-3, -1e-3])).placed(load).signal.x
    np.testing.assert_allclose(moved[:, 5], 2.0 + (2e-3 * 20.0 + 1e-3 * 10.0))
    np.testing.assert_array_equal(moved[:, :5], x[:, :5])


def test_casters_that_lift_off_a_base_that_slides_do_not_either():
    """A plate stands still: 730 N that are 6 mm from where they were make 4 N.m."""
    far = (6e-3, -4e-3, 0.03)
    _, found, springs = rocking(0.8, far)
    np.testing.assert_allclose(np.diag(found.K)[3:5], np.diag(springs)[1:], rtol=0.02)
    _, other, _ = rocking(0.8, far, seen_to_slide=False)
    assert np.abs(np.diag(other.K)[3:5] / np.diag(springs)[1:] - 1.0).max() > 0.1


def test_markers_show_how_far_a_base_has_slid():
    sources, far = laboratory(mjcf.urdf(), DESCRIPTION, ROBOT, PLATE), np.array([6e-3, -4e-3, 0.03])
    trial = rocked(wheel_set(mjcf.urdf(), DESCRIPTION.wheels, G), 0.2, far, np.random.default_rng(2))
    rest, K = rest_of(DESCRIPTION, trial, sources.T_base_B), np.diag([PLANE, PLANE, 5e5, 2e4, 1e4, PLANE])
    load, tried = sources.plate_load(trial, rest.T_lab_0), HeldOut(*np.ones((3, 1, 6)), np.ones(1))
    of = on_springs(K, 1e-3 * K, tried)
    found = slid(DESCRIPTION, trial, rest, load, of)
    np.testing.assert_allclose(found.x[found.t < 1.5], 0.0, atol=1e-4)
    np.testing.assert_allclose(found.x[found.t > 4.0].mean(axis=0), far, atol=1e-4)
    parts = (load.signal.t[:150], load.signal.x[:150], load.signal.valid[:150])
    assert slid(DESCRIPTION, trial, rest, replace(load, signal=Signal(*parts)), of) is None


def test_where_no_wheel_lifts_off_the_compliance_stays():
    linear, found, springs = rocking(0.2)
    np.testing.assert_array_equal(found.K, linear)
    np.testing.assert_allclose(np.diag(found.K)[3:5], np.diag(springs)[1:], rtol=0.02)


BY_TYPE = {"drive": 200e3, "front": 110e3, "back": 160e3}  # [N/m]
PLACE = np.array([1e-3, 2e-3])  # [m] sigma of where the load is


def tilt_stiffness(wheels=SLIPPING):
    """(3, 3) of heave and tilt on vertical springs, wheel by wheel."""
    K = np.zeros((3, 3))
    for kind, (x, y) in zip(wheels.types, wheels.position, strict=True):
        a = np.array([1.0, y, -x])
        K += BY_TYPE[kind] * np.outer(a, a)
    return K


def test_shares_of_the_load_are_ratios_of_the_springs_that_tilt_shows():
    prior = prior_by_tilt(SLIPPING, tilt_stiffness(), PLACE)
    np.testing.assert_allclose(np.exp(prior.mean[11:13]), [200 / 110, 160 / 110], rtol=0.06)  # the wide prior pulls
    assert np.all((prior.sigma[11:13] < 0.2) & (prior.sigma[11:13] >= 0.05))
    np.testing.assert_array_equal(prior.mean[:11], WIDE.mean[:11])
    np.testing.assert_array_equal(prior.sigma[:11], WIDE.sigma[:11])
    np.testing.assert_allclose(prior.sigma[13:15], [0.03, 0.2])  # along x slips show less than they seem to


@pytest.mark.parametrize("off", [0.7, 1.3])
def test_heave_that_is_off_by_a_third_moves_shares_by_less_than_their_sigma(off):
    K = tilt_stiffness()
    K[0, 0] *= off
    assert np.all(
        np.abs(prior_by_tilt(SLIPPING, K, PLACE).mean - prior_by_tilt(SLIPPING, tilt_stiffness(), PLACE).mean)
        < 0.7 * WIDE.sigma
    )
    right = np.log([200 / 110, 160 / 110])
    found = prior_by_tilt(SLIPPING, K, PLACE)
    assert np.all(np.abs(found.mean[11:13] - right) < 1.5 * found.sigma[11:13])


def test_vertical_springs_are_as_stiff_as_the_tilt_shows():
    K, prior = np.zeros((6, 6)), prior_by_tilt(SLIPPING, tilt_stiffness(), PLACE)
    K[np.ix_(HEAVE, HEAVE)] = tilt_stiffness()
    tilting = Tilting(K, np.zeros((6, 6)), shares=np.array([200 / 110, 160 / 110]))
    assert vertical_stiffness(SLIPPING, tilting, prior) == pytest.approx(BY_TYPE["front"])
    assert vertical_stiffness(SLIPPING, tilting, WIDE) == 0.0


def test_where_there_are_no_back_casters_their_share_keeps_the_wide_prior():
    wheels = WheelSet(SLIPPING.names[:4], SLIPPING.types[:4], POSITION[:4], SLIPPING.weight[:4])
    prior = prior_by_tilt(wheels, tilt_stiffness(wheels), PLACE)
    assert prior.sigma[12] == pytest.approx(WIDE.sigma[12], rel=0.01)
    assert prior.mean[12] == pytest.approx(WIDE.mean[12], abs=1e-3)
