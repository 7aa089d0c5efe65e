import numpy as np
import pinocchio as pin
import pytest

import mjcf
from calibration.errors import InputError, NoSuchElement, ShapeError
from calibration.numerics.lie import from_vector
from calibration.robot.chain import chain_of, chain_of_frames
from calibration.robot.hand import nominal_hand
from tests.doubles import rigid_robot

STEP = 1e-6
OTHER_ROBOT = """<robot name="other"><link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="e"/>
<joint name="spin" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0 0 .3" rpy=".1 .2 .3"/>
<axis xyz="0 0 1"/></joint>
<joint name="tilted" type="revolute"><parent link="b"/><child link="c"/><origin xyz=".2 0 .1" rpy="0 1.5 0"/>
<axis xyz=".6 .0 .8"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="left_alone" type="revolute"><parent link="c"/><child link="d"/><origin xyz=".1 .1 0"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="slide" type="prismatic"><parent link="d"/><child link="e"/><origin xyz="0 .4 0" rpy=".3 0 0"/>
<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


def twist(T0: np.ndarray, T1: np.ndarray) -> np.ndarray:
    return pin.log6(pin.SE3(T0).actInv(pin.SE3(T1))).vector


def derivatives(c, q):
    """Of the tool's pose: (n, 6, 6 k) by placement twists, joint by joint, and (n, 6, k) by joint position."""
    J = c.path.placed(q[:, c.columns]).end_twists(c.twists)[:, :, 1:]
    return J[..., :6].reshape(len(q), 6, -1), J[..., 6]


def other_chain():
    return chain_of_frames(OTHER_ROBOT, ("slide", "spin", "tilted"), "a", "e")


@pytest.mark.parametrize("robot", ["tiago", "other"])
def test_derivatives_by_finite_placement_twists_match_finite_differences(chain, robot):
    c = chain if robot == "tiago" else other_chain()
    rng = np.random.default_rng(2)
    c = c.with_placements(0.05 * rng.normal(size=c.xi.shape))
    q = rng.uniform(0.0, 1.0, size=(3, len(c.measured)))
    by_placement, _ = derivatives(c, q)
    for column in range(c.xi.size):
        step = np.zeros(c.xi.size)
        step[column] = STEP
        low, high = (c.with_placements(c.xi + s * step.reshape(-1, 6)).poses(q) for s in (-1.0, 1.0))
        numeric = np.array([twist(a, b) for a, b in zip(low, high, strict=True)]) / (2.0 * STEP)
        np.testing.assert_allclose(by_placement[:, :, column], numeric, atol=2e-9)


@pytest.mark.parametrize("robot", ["tiago", "other"])
def test_derivatives_by_joint_position_match_finite_differences(chain, robot):
    c = chain if robot == "tiago" else other_chain()
    q = np.random.default_rng(3).uniform(0.0, 1.0, size=(3, len(c.measured)))
    _, by_joint = derivatives(c, q)
    for k, column in enumerate(c.columns):
        step = np.zeros(q.shape[1])
        step[column] = STEP
        low, high = c.poses(q - step), c.poses(q + step)
        numeric = np.array([twist(a, b) for a, b in zip(low, high, strict=True)]) / (2.0 * STEP)
        np.testing.assert_allclose(by_joint[:, :, k], numeric, atol=2e-9)


def test_derivatives_of_the_hand_by_all_parameters_match_finite_differences(chain):
    rng = np.random.default_rng(4)
    hand = nominal_hand(chain, np.zeros(12))
    theta = 0.1 * rng.normal(size=len(hand.theta))
    q = rigid_robot.random_angles(rng, 3)
    found = hand.with_theta(theta).poses_and_derivatives(q)
    np.testing.assert_allclose(found.T, hand.with_theta(theta).poses(q), atol=1e-15)
    for column in range(len(theta)):
        step = np.zeros(len(theta))
        step[column] = STEP
        low, high = (hand.with_theta(theta + s * step).poses(q) for s in (-1.0, 1.0))
        numeric = np.array([twist(a, b) for a, b in zip(low, high, strict=True)]) / (2.0 * STEP)
        np.testing.assert_allclose(found.J[:, :, column], numeric, atol=3e-9)


def test_the_chain_agrees_with_the_documented_product_of_transforms(chain):
    rng = np.random.default_rng(5)
    truth = rigid_robot.defects(5)
    hand = nominal_hand(chain.with_placements(truth.xi), np.concatenate([truth.base, truth.hand]))
    q = rigid_robot.random_angles(rng, 20)
    np.testing.assert_allclose(hand.poses(q), rigid_robot.hand_in_base(truth, q), atol=1e-14)
    assert np.allclose(from_vector(truth.base), rigid_robot.se3(truth.base), atol=1e-15)


def test_the_nominal_model_is_unchanged_and_two_calls_give_the_same_bits(chain):
    before = [M.homogeneous.copy() for M in chain.model.jointPlacements]
    q = rigid_robot.random_angles(np.random.default_rng(6), 5)
    moved = chain.with_placements(0.1 * np.ones(chain.xi.shape))
    first, second = derivatives(moved, q), derivatives(moved, q)
    np.testing.assert_array_equal(first[0], second[0])
    np.testing.assert_array_equal(before, [M.homogeneous for M in chain.model.jointPlacements])
    np.testing.assert_array_equal(chain.xi, 0.0)


def test_only_joints_between_base_and_tool_belong_to_the_chain(chain):
    assert chain.joints == rigid_robot.JOINTS
    assert other_chain().joints == ("spin", "tilted", "slide")
    shoulder = chain_of(mjcf.urdf(), rigid_robot.described(tool_frame="arm_2_link"))
    assert shoulder.joints == ("torso_lift_joint", "arm_1_joint", "arm_2_joint")


def test_a_frame_or_joint_that_does_not_exist_is_named_with_those_that_do():
    with pytest.raises(NoSuchElement, match="gripper_grasping_frame"):
        chain_of(mjcf.urdf(), rigid_robot.described(tool_frame="hand"))
    with pytest.raises(NoSuchElement, match="arm_1_joint"):
        chain_of_frames(mjcf.urdf(), ("arm_9_joint",), "base_link", "arm_7_link")


def test_a_base_frame_that_moves_or_a_tool_that_does_not_is_refused():
    with pytest.raises(InputError, match="moves with joint"):
        chain_of(mjcf.urdf(), rigid_robot.described(base_frame="arm_1_link"))
    with pytest.raises(InputError, match="no measured joint"):
        chain_of(mjcf.urdf(), rigid_robot.described(tool_frame="base_link"))


def test_readings_of_the_wrong_width_are_refused(chain):
    with pytest.raises(ShapeError, match=r"\(3, 7\)"):
        chain.poses(np.zeros((3, 7)))
