"""A column that leans against joints that are placed so; loads on links where the geometry has them."""

from dataclasses import replace

import numpy as np
import pinocchio as pin

from calibration.stages.drive_trains import DriveTrain, DriveTrains, stream_of
from calibration.stages.drive_trains.torques import Column, Dynamics, derivatives, inertial_tolerances

LINK = (
    '<link name="{0}"><inertial><origin xyz="{1} 0 0.1"/><mass value="3"/>'
    '<inertia ixx="0.02" iyy="0.03" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
JOINT = (
    '<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{0}_link"/><origin xyz="0.1 0 {3}"/>'
    '<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="9" velocity="9"/></joint>'
)
URDF = (
    '<robot name="arm"><link name="base"/>'
    + LINK.format("column_link", 0.0)
    + LINK.format("shoulder_link", 0.4)
    + JOINT.format("column", "prismatic", "base", 0.3)
    + JOINT.format("shoulder", "revolute", "column_link", 0.2)
    + "</robot>"
)
GRAVITY, SOFT = np.array([0.0, 0.0, -9.81]), np.array([1e-5, 2e-5])
T = np.arange(0.0, 3.0, 0.01)
Q = np.column_stack([0.02 * np.sin(2.0 * T), 1.2 * np.sin(1.5 * T)])


def arm(column: Column, turn: np.ndarray | None = None) -> Dynamics:
    """With its column placed a rotation vector (3,) beside where it nominally is."""
    model = pin.buildModelFromXML(URDF, pin.JointModelFreeFlyer())
    model.gravity = pin.Motion.Zero()
    if turn is not None:
        model.jointPlacements[2] = model.jointPlacements[2] * pin.SE3(pin.exp3(turn), np.zeros(3))
    return Dynamics(model, ("column", "shoulder"), np.zeros(2), GRAVITY, column)


def test_a_column_that_leans_loads_joints_as_one_that_stands_so():
    """At rest, to first order: 3 kg at 0.4 m from the axis of a shoulder that leans by tenths of a milliradian."""
    column, still = Column(SOFT, np.array([2.0, -5.0])), np.zeros((1, 2))
    for shoulder in (-1.0, 0.3, 2.0):
        q = np.array([[0.05, shoulder]])
        nominal = arm(Column(np.zeros(2), np.zeros(2))).evaluated(q, still, still, None)
        leaning = arm(column).evaluated(q, still, still, None)[0][0, 1]
        turn = np.append(SOFT * (column.mean - nominal[3][0]), 0.0)
        placed = arm(Column(np.zeros(2), np.zeros(2)), turn).evaluated(q, still, still, None)[0][0, 1]
        assert nominal[0][0, 1] == 0.0 and abs(placed) > 5e-5
        np.testing.assert_allclose(leaning, placed, rtol=2e-3)


def test_samples_one_by_one_lean_as_the_recording_in_one_go():
    values = np.array([1e-3, 1e-4, 1e-4, 0.05, 2e-3, 0.0, 0.0])
    rigid, leaning = (
        DriveTrains(arm(Column(soft, np.array([3.0, 1.0]))), (DriveTrain("shoulder", "dead_zone", values),), "", None)  # type: ignore[arg-type]
        for soft in (np.zeros(2), 50.0 * SOFT)
    )
    smooth, v, a = derivatives(T, Q, 20.0)
    batch, unbent = (of.of_loads(replace(of.dynamics.loads("", T, Q), q=smooth)).q for of in (leaning, rigid))
    stream = stream_of(leaning)
    state, angles = stream.begin(T[0], np.array([smooth[0], v[0], a[0]]))
    found = [angles.q]
    for i in range(1, len(T)):
        state, angles = stream.step(state, T[i], np.array([smooth[i], v[i], a[i]]))
        found.append(angles.q)
    assert np.abs(np.concatenate(found) - batch).max() < 1e-12 < 1e-5 < np.abs(batch - unbent).max()


def test_loads_know_what_a_plate_weighed():
    """Three bodies, the root's first; the last one hangs on the wrist."""
    robot, root = arm(Column(SOFT, np.zeros(2))), np.random.default_rng(0).normal(size=(12, 12))
    weighed = 1e-4 * root @ root.T
    tolerances, known = (inertial_tolerances(robot, 0.1, 0.01, None, *more) for more in ((), (weighed,)))
    body = robot.model.inertias[2]
    by_share, by_shift = np.append(body.mass, body.mass * body.lever), body.mass * np.eye(4)[:, 1:]
    J = np.column_stack([by_share, by_shift])
    np.testing.assert_allclose(known[:4, :4], J @ weighed[4:8, 4:8] @ J.T, rtol=1e-12)
    np.testing.assert_array_equal(known[4:], tolerances[4:])
    assert not known[:4, 4:].any() and np.linalg.eigvalsh(known).min() > -1e-12


def test_a_known_column_is_not_looked_for_in_its_torques():
    stiff, soft = (inertial_tolerances(arm(Column(c, np.zeros(2))), 0.1, 0.01)[-1, -1] for c in (0.0 * SOFT, SOFT))
    assert soft == (0.05 * SOFT.max()) ** 2 < stiff


def test_a_column_does_not_lean_under_the_mean_moment_of_the_postures():
    """The placement that takes up a lean in the middle of the postures, and the lean less that middle, cancel."""
    q, still = np.array([[0.0, 0.7]]), np.zeros((1, 2))
    moment = arm(Column(np.zeros(2), np.zeros(2))).evaluated(q, still, still, None)[3][0]
    base = np.concatenate([np.zeros(6), -GRAVITY, np.zeros(3)])[None]
    there = arm(Column(SOFT, moment)).evaluated(q, still, still, base)[0]
    np.testing.assert_allclose(there[0, 1], 0.0, atol=1e-12)
