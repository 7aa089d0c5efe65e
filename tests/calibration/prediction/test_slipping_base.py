"""What heave and tilt of the base add to a step."""

import numpy as np
import pinocchio as pin
import pytest

from calibration.prediction.slipping_base import driven, lagged
from calibration.robot.rigid_tree import room, scratch, tree_of
from calibration.stages.stick_slip.forcing import CUTOFF
from calibration.stages.stick_slip.kernel.bases import HEAVE, PLANE

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
