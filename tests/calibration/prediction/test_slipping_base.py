"""What heave and tilt of the base add to a step, and where the robot stands."""

import numpy as np
import pinocchio as pin
import pytest

import mjcf
from calibration.prediction.slipping_base import SlippingBase, driven, lagged
from calibration.robot.laboratory import Laboratory
from calibration.robot.rigid_tree import scratch, tree_of
from calibration.robot.tree_dynamics import room
from calibration.stages.stick_slip.forcing import CUTOFF, Tilting
from calibration.stages.stick_slip.kernel.bases import HEAVE, PLANE
from calibration.stages.stick_slip.model import StickSlip
from calibration.stages.stick_slip.wheels import wheel_set
from tests.doubles import rigid_robot
from tests.doubles.moving_base import WHEELS

GRAVITY = np.array([0.0, 0.0, -9.81])


@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_an_acceleration_is_that_of_two_lags_ago(rate):
    """h = cos(w t) through 1 / (1 + i w tau)^2, whatever the rate of the samples is."""
    t, w, late = np.arange(0.0, 2.0, 1.0 / rate), 2.0 * np.pi * 3.0, 1.0 / (2.0 * np.pi * CUTOFF)
    h = np.cos(np.outer(t, w * np.ones(3)))
    lags, found = np.tile(h[0], (2, 1)), []
    for before, now in zip(h[:-1], h[1:], strict=True):
        lags, a = lagged(now, before, lags, 1.0 / rate)
        found.append(a)
    expected = (-(w**2) * np.exp(1j * w * t[1:]) / (1.0 + 1j * w * late) ** 2).real
    after = t[1:] > 1.0
    np.testing.assert_allclose(
        np.array(found)[after, 1], expected[after], atol=0.05 * w**2
    )  # lags are linear in a sample


def test_heave_and_tilt_push_the_base_by_its_composite_inertia():
    model, parent = pin.Model(), 0
    for joint in (pin.JointModelFreeFlyer(), pin.JointModelRZ(), pin.JointModelRY(), pin.JointModelRX()):
        parent = model.addJoint(parent, joint, pin.SE3(np.eye(3), np.full(3, 0.1)), f"joint_{parent}")
        model.appendBodyToJoint(parent, pin.Inertia(3.0, np.full(3, 0.05), 0.1 * np.eye(3)), pin.SE3.Identity())
    model.gravity = pin.Motion.Zero()
    joints = ("joint_1", "joint_2", "joint_3")
    tree, k = tree_of(model, joints), len(joints)
    T = pin.exp6(np.array([0.1, -0.2, 0.3, 0.0, 0.0, 0.4]))
    actions = np.array(T.dualAction, order="C"), np.array(T.inverse().action, order="C")
    moving = np.array([np.linspace(-0.5, 0.5, k), np.ones(k), -np.ones(k)])
    a, found = np.array([0.7, -0.4, 0.9]), room(1, len(tree.column))
    level, base = np.zeros((2, 3)), np.array([np.zeros(3), a])
    still, heaving = (driven(tree, actions, GRAVITY, x, moving, scratch(tree), found) for x in (level, base))
    M = actions[0] @ found.composite[0] @ actions[1]
    np.testing.assert_allclose(heaving[:3] - still[:3], -(M[np.ix_(PLANE, HEAVE)] @ a), atol=1e-9)
    np.testing.assert_array_equal(heaving[3:], still[3:])


def test_a_sample_s_force_acts_where_the_robot_stands():
    """5 mm ahead and 3 mm to the right of where its markers have it: so do its inertia and its moment."""
    lab = Laboratory(mjcf.urdf(), rigid_robot.described(wheels=[w.model_dump() for w in WHEELS]))
    wheels, off = wheel_set(mjcf.urdf(), WHEELS, 9.81), np.array([5e-3, -3e-3])
    moving = np.array([np.full(8, 0.2), np.full(8, 0.5), np.linspace(1.0, 4.0, 8)])
    here, there = (
        SlippingBase(StickSlip(wheels, Tilting(np.eye(6), np.eye(6), o), ()), lab, "plate")._driven(GRAVITY, moving)
        for o in (0.0 * off, off)
    )
    np.testing.assert_allclose(there[:2], here[:2], atol=1e-9)
    assert there[2] == pytest.approx(here[2] + off[0] * here[1] - off[1] * here[0], abs=1e-9)
    assert there[7] == pytest.approx(here[7] + off[0] * here[3], abs=1e-9) and here[:2].any()
