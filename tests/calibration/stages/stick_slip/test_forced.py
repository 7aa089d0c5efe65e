"""What drives the base in use: links on a base that moves, and heave by a base that slips, or by a plate."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.interpolate import CubicSpline

import mjcf
from calibration.errors import NotEnoughData
from calibration.numerics.lie import from_vector
from calibration.numerics.signals import Signal, even, low_passed
from calibration.recording.clock import Clock
from calibration.stages.drive_trains import DriveTrain, DriveTrains
from calibration.stages.drive_trains.torques import dynamics
from calibration.stages.stick_slip import wrenches_of
from calibration.stages.stick_slip.band import Band
from calibration.stages.stick_slip.forcing import (
    CUTOFF,
    STEPS,
    Readings,
    Tilting,
    planar_forcing,
    readings_of,
)
from calibration.stages.stick_slip.kernel.bases import HEAVE, PLANE, TILTS
from calibration.stages.stick_slip.likelihood import bases_of
from calibration.stages.stick_slip.model import Direction, StickSlip
from calibration.stages.stick_slip.poses import Links, forced, moved_together, planar_twist, upright
from calibration.stages.stick_slip.wheels import wheel_set
from calibration.stages.suspension.base_response import laboratory
from calibration.stages.suspension.cross_validation import HeldOut
from calibration.stages.suspension.floor_wrench import motion_load, root_in_base
from calibration.stages.suspension.weighing import FARTHEST
from tests.calibration.stages.stick_slip.slipping import TRUTH
from tests.doubles import rigid_robot
from tests.doubles.moving_base import T_LAB_BASE, WHEELS

DESCRIPTION = rigid_robot.described(wheels=[w.model_dump() for w in WHEELS])
ROBOT, PLATE = (Clock(i, 0.0, 0.0, np.zeros((2, 2)), 0.0, 1e-4) for i in ("robot", "plate"))
STILL = rigid_robot.Truth(marker_sigma=1e-5, encoder_quantum=0.0, robot=(0.0, 0.0), plate=(0.0, 0.0))
SOURCES = laboratory(mjcf.urdf(), DESCRIPTION, ROBOT, PLATE)
K = np.diag([1e5, 1e5, 9e5, 2e4, 2e4, 1e4])


@pytest.fixture(scope="module")
def trial():
    amplitudes = np.zeros(8)
    amplitudes[[1, 2]] = 0.3
    motor = rigid_robot.swing(amplitudes, np.full(8, 0.6), 5.0)
    return rigid_robot.record(STILL, motor, 0.0, np.random.default_rng(0))


def model():
    sums = np.ones((2, 3))
    tried = HeldOut(1e-6 * sums, 1e-4 * sums, 1e-12 * sums, np.ones(2))
    band, C = Band(*np.full((4, 3), 1e-4)), 1e-4 * np.eye(13)
    of = (Direction(s, TRUTH.logarithms, C, TRUTH.logarithms[None], band, tried) for s in ("plate", "dynamics"))
    return StickSlip(wheel_set(mjcf.urdf(), WHEELS, 9.81), Tilting(K, 0.01 * K), tuple(of))


def links(trial, half_gap):
    values = np.array([half_gap, 1e-7, 0.3, 0.1, 6e-3, 0.0, 0.0])
    trains = (DriveTrain("arm_1_joint", "dead_zone", values, dynamic=False),)
    robot = dynamics(mjcf.urdf(), DESCRIPTION, np.zeros(8))
    of = DriveTrains(robot, trains, mjcf.urdf(), DESCRIPTION)
    return Links(SOURCES.lab, of, Readings(*readings_of(ROBOT, trial)[:2]), T_LAB_BASE)


def test_a_plate_says_what_wheels_bear_whatever_the_links_do(trial):
    """Links say what accelerates the base in between."""
    wrenches, of = wrenches_of(SOURCES, trial, T_LAB_BASE), model()
    one, other = (forced(of, wrenches, "plate", behind).drive for behind in (links(trial, 3e-3), None))
    np.testing.assert_array_equal(one[:, 3:TILTS], other[:, 3:TILTS])
    assert np.abs(one[:, 2] - other[:, 2]).max() > 0.1 * np.abs(other[:, 2]).max()


def test_the_last_step_of_a_sample_is_at_its_time(trial):
    wrenches = wrenches_of(SOURCES, trial, T_LAB_BASE)
    forcing, w = planar_forcing(wrenches, Tilting(K, 0.01 * K), "plate"), wrenches.plate.signal
    at_t = CubicSpline(w.t, w.x)(forcing.t)
    np.testing.assert_allclose(forcing.drive[STEPS - 1 :: STEPS, 3], -at_t[:, 2])
    np.testing.assert_allclose(np.diff(forcing.drive[:, 3]).std(), np.diff(at_t[:, 2]).std() / STEPS, rtol=0.3)


def test_a_robot_that_stands_elsewhere_under_its_markers_resists_there(trial):
    """Inertia is that of the same bodies, seen from an origin 5 mm behind and 3 mm left of theirs."""
    off, wrenches = np.array([5e-3, -3e-3]), wrenches_of(SOURCES, trial, T_LAB_BASE)
    here, there = (planar_forcing(wrenches, Tilting(K, 0.01 * K, o), "dynamics") for o in (0.0 * off, off))
    A, M, upper = (
        np.array([[1.0, 0.0, -off[1]], [0.0, 1.0, off[0]], [0.0, 0.0, 1.0]]),
        np.zeros((3, 3)),
        np.triu_indices(3),
    )
    M[upper] = here.inertia[40, :6]
    expected = A.T @ (M + np.triu(M, 1).T) @ A
    np.testing.assert_allclose(there.inertia[40, :6], expected[upper], rtol=1e-9)
    assert there.inertia[40, 4] - here.inertia[40, 4] > 0.3  # [kg.m]


def test_a_base_leans_by_what_stands_on_it(trial):
    """10 mrad forwards under 200 N.m about y; its tilt counts from there."""
    stiff = Tilting(K, 0.01 * K)
    np.testing.assert_allclose(stiff.leans(np.array([700.0, 200.0, -30.0])), [30.0 / K[3, 3], 200.0 / K[4, 4]])
    soft = replace(stiff, K=np.diag([1e5, 1e5, 9e5, 1e2, 1e2, 1e4]))  # as where nothing showed the tilt
    np.testing.assert_array_equal(soft.leans(np.array([700.0, 200.0, -30.0])), [FARTHEST, FARTHEST])
    forcing = planar_forcing(wrenches_of(SOURCES, trial, T_LAB_BASE), stiff, "plate")
    leans = stiff.leans(forcing.drive[: STEPS * 100, 3:6].mean(axis=0))
    np.testing.assert_allclose(forcing.drive[: STEPS * 100, 6:8].mean(axis=0), leans, atol=2e-6)
    assert np.abs(leans).max() > 1e-4


def test_links_weigh_where_they_are_by_the_zeros_of_their_readings(trial):
    behind, zeros = links(trial, 0.0), 0.1 * np.eye(8)[4]
    off = behind._replace(trains=behind.trains.with_offset(zeros))
    poses = np.tile(T_LAB_BASE, (len(trial.t_mocap), 1, 1))
    found, read = (x.load(trial.t_mocap, poses).signal.x for x in (off, behind))
    expected = motion_load(SOURCES.lab, trial.t_robot, trial.q_motor - zeros, T_LAB_BASE, CUTOFF).signal.x
    np.testing.assert_allclose(found[:, 4].mean(), expected[:, 4].mean(), atol=0.02)
    assert abs(read[:, 4].mean() - expected[:, 4].mean()) > 0.5


def test_a_base_that_turns_feels_what_the_arm_does_by_turning(trial):
    t, q, lab = trial.t_robot, trial.q_motor, SOURCES.lab
    twist = np.array([0.03, -0.02, 0.0, 0.0, 0.0, 0.4])
    still = motion_load(lab, t, q, T_LAB_BASE, CUTOFF).signal
    turning = motion_load(lab, t, q, T_LAB_BASE, CUTOFF, twist=np.tile(twist, (len(t), 1))).signal
    model, T_0_root = lab.floating, root_in_base(lab.floating, DESCRIPTION)
    data, columns = model.createData(), [model.idx_vs[model.getJointId(n)] for n in DESCRIPTION.joint_names]
    smooth = low_passed(even(t, q), CUTOFF)
    along = CubicSpline(smooth.t, smooth.x)
    for k in range(100, 400, 60):
        move, v, a = np.zeros((3, model.nv))
        move[columns], v[columns], a[columns] = (along(turning.t[k], d) for d in range(3))
        v[:6] = T_0_root.inverse().action @ twist
        root = pin.rnea(model, data, pin.integrate(model, pin.neutral(model), move), v, a)[:6]
        np.testing.assert_allclose(turning.x[k], -T_0_root.dualAction @ root, atol=1e-6)
    assert np.abs(turning.x - still.x).max(axis=0)[[0, 1, 5]].min() > 0.3


def test_a_twist_is_that_of_the_base_in_its_own_axes():
    t, rate = np.arange(300) / 100.0, 0.3
    T = np.tile(T_LAB_BASE, (len(t), 1, 1))
    T[:, :3, :3] = [T_LAB_BASE[:3, :3] @ pin.exp3(np.array([0.0, 0.0, rate * s])) for s in t]
    T[:, :3, 3] += T[:, :3, :3] @ [1.0, 0.0, 0.0]  # 1 m before the axis it turns about
    found = planar_twist(t, upright(T, T_LAB_BASE)[:, PLANE], t)[50:250]
    np.testing.assert_allclose(found, np.tile([0.0, rate, 0.0, 0.0, 0.0, rate], (200, 1)), atol=2e-3 * rate)


def test_a_base_that_slides_away_from_the_plates_centre_tilts(trial):
    """Its weight stays where it is on the base: the plate's moment about the base is what the tilt follows."""
    wrenches, of = wrenches_of(SOURCES, trial, T_LAB_BASE), model()
    weak = TRUTH.logarithms.copy()
    weak[4:7] += np.log(0.2)
    slippery = replace(of, directions=tuple(replace(d, logarithms=weak, ensemble=weak[None]) for d in of.directions))
    found, still = forced(slippery, wrenches, "plate", None), planar_forcing(wrenches, of.tilting, "plate")
    far = slippery.predict(still).x - still.linear
    end = slice(-20, None)
    x, y, yaw = far[end].T
    weight, pitching, rolling = still.drive[::2][end, 3:6].T
    assert np.abs(far[end, :2]).max() > 2e-4
    expected = np.column_stack([weight * y + yaw * pitching, yaw * rolling - weight * x]) / np.diag(K)[3:5]
    tilted = (found.heave - still.heave)[end, 1:]
    np.testing.assert_allclose(tilted, expected, atol=0.1 * np.abs(expected).max())


def test_links_that_strike_in_their_gaps_move_the_base(trial):
    wrenches, of = wrenches_of(SOURCES, trial, T_LAB_BASE), model()
    by_motors, tight, loose = (
        forced(of, wrenches, "dynamics", behind).force[:, 2] for behind in (None, links(trial, 0.0), links(trial, 3e-3))
    )
    assert np.abs(tight - by_motors).max() < 0.01 * np.abs(by_motors).max()
    assert np.abs(loose - by_motors).max() > 0.1 * np.abs(by_motors).max()


def test_a_base_and_links_that_are_moved_together_agree_with_each_other(trial):
    """The base moves as those links throw it, and they as it does; one after the other, what comes next is another."""
    of, behind, wrenches = model(), links(trial, 1e-3), wrenches_of(SOURCES, trial, T_LAB_BASE)
    (train,) = behind.trains.trains
    softer = replace(train, values=np.array([1e-3, 1e-4, 0.5, 0.5, 6e-3, 0.0, 0.0]), dynamic=True)
    behind = behind._replace(trains=replace(behind.trains, trains=(softer,)))
    forcing = planar_forcing(wrenches, of.tilting, "dynamics")
    x, bases = np.zeros((len(forcing.t), 6)), bases_of(of.wheels, TRUTH.logarithms[None], False)
    x[:, HEAVE] = forcing.heave
    shared = Signal(wrenches.t, wrenches.P[..., PLANE], np.ones(len(wrenches.t), dtype=bool))

    def next_of(x, angles):
        """The base that inverse dynamics of links on a base move, and links that this base moves."""
        T = behind.T_lab_0 @ from_vector(x)
        of_links = planar_forcing(replace(wrenches, links=behind.load(forcing.t, T, angles)), of.tilting, "dynamics")
        return of.displacement(of_links)[0][:, 5], behind.trains.likely(behind.loads(forcing.t, T))[:, 1]

    loads = behind.loads(forcing.t, behind.T_lab_0 @ from_vector(x))
    x[:, PLANE], angles = moved_together(bases, forcing, shared, behind.trains, loads)
    first = of.displacement(forcing)[0]
    slower = replace(softer, values=np.array([1e-3, 1e-4, 0.5, 0.5, 12e-3, 0.0, 0.0]))  # of a base that does not yield
    again = moved_together(bases, forcing, shared, replace(behind.trains, trains=(slower,)), loads)
    np.testing.assert_array_equal(again[1], angles)
    with pytest.raises(NotEnoughData, match="masses of links"):
        moved_together(bases, forcing, replace(shared, x=10.0 * shared.x), behind.trains, loads)
    (yaw, link), (other, _) = next_of(x, angles), next_of(first, None)
    assert np.std(yaw - x[:, 5]) < 0.5 * np.std(other - first[:, 5])
    assert np.std(link - angles[:, 1]) < 0.5 * np.std(next_of(first, angles)[1] - angles[:, 1])


def test_the_base_tilts_as_it_slips(trial):
    """Under a fifth of the friction the floor takes less of what the arm does, and the base tilts otherwise."""
    wrenches, of = wrenches_of(SOURCES, trial, T_LAB_BASE), model()
    weak = TRUTH.logarithms.copy()
    weak[4:7] += np.log(0.2)
    slippery = replace(of, directions=tuple(replace(d, logarithms=weak, ensemble=weak[None]) for d in of.directions))
    firm, loose = (forced(one, wrenches, "dynamics", None).heave for one in (of, slippery))
    assert np.all(np.abs(loose - firm).max(axis=0)[1:] > 0.2 * np.abs(firm).max(axis=0)[1:])
    nowhere = Signal(np.array([0.0, 1e3]), np.zeros((2, 3)), np.ones(2, dtype=bool))
    seen = planar_forcing(replace(wrenches, slid=nowhere), of.tilting, "dynamics")
    np.testing.assert_allclose(
        seen.heave, planar_forcing(wrenches, of.tilting, "plate").heave[: len(seen.t)], atol=1e-9
    )
