"""Torques against closed forms; samples one by one against a recording in one go; JSON; payloads left alone."""

import json
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from calibration.estimate.plain_values import plain, restored
from calibration.numerics.lie import from_vector
from calibration.prediction.bundled_arm import BundledArm, moving_root
from calibration.stages.drive_trains import DriveTrain, DriveTrains, stream_of
from calibration.stages.drive_trains.column_bending import ColumnBending
from calibration.stages.drive_trains.drive_train import Quantity
from calibration.stages.drive_trains.kernel.link_streams import RESTS
from calibration.stages.drive_trains.torques import (
    Dynamics,
    base_motion,
    derivatives,
    inertial_tolerances,
    inertials,
)

LINK = (
    '<link name="{0}"><inertial><origin xyz="0 0 -0.3"/><mass value="2"/>'
    '<inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
JOINT = (
    '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="0 0 {3}"/>'
    '<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="9" velocity="9"/></joint>'
)
URDF = (
    '<robot name="two"><link name="base"/>'
    + LINK.format("one")
    + LINK.format("two")
    + JOINT.format("first", "base", "one", 0.0)
    + JOINT.format("second", "one", "two", -0.6)
    + "</robot>"
)
T = np.arange(0.0, 6.0, 0.01)
Q = np.column_stack([0.8 * np.sin(1.1 * T), 0.9 * np.sin(1.7 * T + 0.4)])


def dynamics() -> Dynamics:
    model = pin.buildModelFromXML(URDF, pin.JointModelFreeFlyer())
    model.gravity = pin.Motion.Zero()
    return Dynamics(model, ("first", "second"), np.zeros(2), np.array([0.0, 0.0, -9.81]))


def trains() -> DriveTrains:
    robot, values = dynamics(), np.array([3e-3, 8e-4, 0.15, 0.05, 1.5e-3, 0.0, 0.0])
    sure = {"residual": 2e-5, "doubt": 0.6, "doubt_at_rest": 1.4}
    shown = (Quantity("backlash.second.gap", "rad", 6e-3, 1e-4, "estimated"),)
    of = (
        DriveTrain("first", "dead_zone", values, dynamic=False, motor=np.array([1e-3, 0.0, 2e-4, 0.0]), **sure),
        DriveTrain(
            "second", "dead_zone", values, inertials=np.full(len(inertials(robot)), 1e-3), parameters=shown, **sure
        ),
    )
    return DriveTrains(robot, of, "", None)  # type: ignore[arg-type]


def test_gravity_and_inertia_of_a_pendulum() -> None:
    robot, q = dynamics(), np.array([[0.3, 0.0]])
    still = np.zeros((1, 2))
    torque, inertia, *_ = robot.evaluated(q, still, still, None)
    assert torque[0, 1] == pytest.approx(2.0 * 9.81 * 0.3 * np.sin(0.3), rel=1e-12)
    own, above = 0.02 + 2.0 * 0.3**2, 2.0 * 0.3 * 0.6 * np.cos(0.0)
    expected = [[0.02 + 2.0 * 0.3**2 + 2.0 * 0.6**2 + 2.0 * above + own, own + above], [own + above, own]]
    np.testing.assert_allclose(inertia[0, :2, :2], expected, rtol=1e-12)


def test_regressors_are_what_other_masses_do() -> None:
    robot, q = dynamics(), np.array([[0.3, -0.5]])
    v, a = np.array([[0.7, 0.2]]), np.array([[1.0, -2.0]])
    torque, _, R, *_ = robot.evaluated(q, v, a, None)
    heavier = robot.model.copy()
    heavier.inertias[3] = heavier.inertias[3] + pin.Inertia(0.1, np.array([0.01, 0.0, 0.2]), np.zeros((3, 3)))
    again, *_ = replace(robot, model=heavier).evaluated(q, v, a, None)
    dphi = np.zeros(R.shape[2])
    dphi[4:8] = 0.1, 1e-3, 0.0, 0.02
    point = 0.1 * np.array([0.2**2 + 0.01**2])  # of a point mass about its joint, which first moments leave out
    assert (torque + R @ dphi)[0, 1] + point[0] * (a[0].sum()) == pytest.approx(again[0, 1], rel=1e-9)
    assert inertial_tolerances(robot, 0.1, 0.01).shape == (R.shape[2], R.shape[2])


def test_a_tilt_of_the_base_is_a_turned_gravity() -> None:
    robot, q, still = dynamics(), np.array([[0.3, -0.5]]), np.zeros((1, 2))
    torque, _, R, *_ = robot.evaluated(q, still, still, None)
    tilted = replace(robot, gravity=9.81 * np.array([np.sin(1e-5), 0.0, -np.cos(1e-5)]))
    again, *_ = tilted.evaluated(q, still, still, None)
    assert (again - torque)[0] / 1e-5 == pytest.approx(R[0, :, -2], rel=1e-4)


def test_samples_one_by_one_are_the_recording_in_one_go() -> None:
    of, q = trains(), Q[np.maximum(np.arange(len(T)) - 50, 0)]  # at rest to begin with
    smooth, v, a = derivatives(T, q, 20.0)
    loads = replace(of.dynamics.loads("", T, q), q=smooth)
    batch, stream = of.of_loads(loads), stream_of(of)
    state, angles = stream.begin(T[0], np.array([smooth[0], v[0], a[0]]))
    found = [angles]
    for i in range(1, len(T)):
        state, angles = stream.step(state, T[i], np.array([smooth[i], v[i], a[i]]))
        found.append(angles)
    assert (batch.high - batch.low)[np.abs(v) < RESTS].max() > 1e-5  # a link at rest whose side is not known
    for name in ("q", "low", "high", "variance"):
        one_by_one = np.concatenate([getattr(x, name) for x in found])
        assert np.abs(one_by_one - getattr(batch, name)).max() < 1e-12


def test_a_step_leaves_the_state_before_it_as_it_was() -> None:
    stream = stream_of(trains())
    state, _ = stream.begin(0.0, np.array([Q[0], np.zeros(2), np.zeros(2)]))
    kept = state.states.copy()
    stream.step(state, 0.01, np.array([Q[1], np.ones(2), np.zeros(2)]))
    assert (state.states == kept).all()


def test_link_angles_lag_behind_their_motors_by_half_the_gap_at_least() -> None:
    of = trains()
    found = of.of_loads(of.dynamics.loads("", T, Q))
    delta = Q - found.q
    assert 3e-3 < np.abs(delta[:, 1]).max() < 3e-3 + 8e-4 * 20.0
    assert (found.low <= found.q + 1e-12).all() and (found.q <= found.high + 1e-12).all()


def test_a_link_that_nothing_loads_stopped_on_one_of_its_flanks() -> None:
    arm = BundledArm(trains(), ColumnBending("first", np.zeros(2), np.zeros(2)), np.zeros(2))
    found = arm.at_rest(np.zeros((1, 2)))
    np.testing.assert_allclose(found.variance[0, 0], (3e-3 + 0.15 * 8e-4) ** 2 + 2e-5**2, rtol=1e-6)


def test_drive_trains_come_back_from_json() -> None:
    of = trains()
    read = restored(tuple[DriveTrain, ...], json.loads(json.dumps(plain(of.trains))))
    again = replace(of, trains=read)
    loads = of.dynamics.loads("", T, Q)
    assert (again.of_loads(loads).q == of.of_loads(loads).q).all()
    assert (of.likely(loads) == of.of_loads(loads).q).all()


def test_a_base_that_tilts_and_turns_loads_the_joints_by_its_proper_acceleration() -> None:
    gravity, turn = np.array([0.0, 0.0, -9.81]), 0.02 * np.sin(2.0 * np.pi * 0.5 * T)
    tilt = from_vector(np.array([0.0, 0.0, 0.0, 0.004, 0.0, 0.0]))
    twist = np.zeros((len(T), 6))
    twist[:, 5] = turn
    found = base_motion(gravity, T, tilt @ from_vector(twist), T)
    inside = slice(100, -100)
    assert found[inside, 7] == pytest.approx(9.81 * 0.004 * np.cos(turn[inside]), rel=1e-3)
    assert found[inside, 11] == pytest.approx(-((2.0 * np.pi * 0.5) ** 2) * turn[inside], abs=2e-3)
    assert found[inside, 5] == pytest.approx(np.gradient(turn, T)[inside], abs=1e-4) and not found[:, :3].any()
    short = base_motion(gravity, T[:50], np.broadcast_to(tilt, (50, 4, 4)), T[:3])
    assert short[:, 7] == pytest.approx(9.81 * np.sin(0.004), rel=1e-9) and short.shape == (3, 12)
    assert base_motion(gravity, T, np.full((len(T), 4, 4), np.nan), T) is None


def test_a_sample_of_a_base_that_moves_is_that_of_its_recording() -> None:
    """In lab axes, of a base that leans by 0.1 rad; its root is 0.2 m beside it."""
    gravity, lean = np.array([0.0, 0.0, -9.81]), from_vector(np.array([0.3, 0.1, 0.0, 0.1, 0.0, 0.0]))
    twist, beside = np.zeros((len(T), 6)), from_vector(np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.5]))
    twist[:, 0], twist[:, 5] = 2e-3 * np.sin(3.0 * T), 5e-3 * np.sin(2.0 * T)
    poses, i, R = lean @ from_vector(twist), 300, lean[:3, :3]
    moves = np.zeros((3, 3))
    moves[:2] = -9.0 * twist[i, 0] * R[:, 0], -4.0 * twist[i, 5] * R[:, 2]
    moves[2] = 1e-2 * np.cos(2.0 * T[i]) * R[:, 2]
    seen = base_motion(gravity, T, poses @ beside, T)[i]
    np.testing.assert_allclose(moving_root(poses[i], beside, gravity, moves)[0, 3:], seen[3:], atol=1e-3)
    assert np.abs(seen[3:6]).max() > 5e-3


def test_a_jolt_of_the_base_stands_above_the_noise_of_its_markers() -> None:
    """15 Hz for a tenth of a second, by exact poses; by noisy ones, what is no jolt is left out."""
    gravity, at, waves = np.array([0.0, 0.0, -9.81]), T - 3.0, np.zeros((2, len(T), 6))
    waves[:, :, 0] = 2e-4 * np.sin(30.0 * np.pi * at) * np.exp(-((at / 0.1) ** 2))
    waves[1, :, 0] += 3e-5 * np.random.default_rng(0).normal(size=len(T))
    exact, noisy = (base_motion(gravity, T, from_vector(x), T)[:, 6] for x in waves)
    true = np.gradient(np.gradient(waves[0, :, 0], T), T)
    assert exact @ true > 0.6 * true @ true
    assert np.std(noisy[T > 4.0]) < 0.3 * np.std(derivatives(T, waves[1], 20.0)[2][T > 4.0, 0])


def test_a_plate_says_how_a_base_accelerates_that_hardly_moves() -> None:
    """8 Hz of 10 um, as long as the trial: noise of markers looks like that."""
    gravity, wave = np.array([0.0, 0.0, -9.81]), np.zeros((len(T), 6))
    wave[:, 0] = 1e-5 * np.sin(16.0 * np.pi * T)
    true, inside = -((16.0 * np.pi) ** 2) * wave[:, 0], slice(100, -100)
    seen, by_plate = (base_motion(gravity, T, from_vector(wave), T, by)[inside, 6] for by in (False, True))
    assert np.std(seen) < 0.2 * np.std(true[inside]) and np.std(by_plate) > 0.6 * np.std(true[inside])
