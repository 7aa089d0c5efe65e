"""The nominal robot is the published one, but for what it corrects."""

import math
import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import mjcf
from tests.mjcf.elements import joints, robot_bodies

HALF_PI = math.pi / 2


# Joint placements as published: parent link, child link, xyz [m], rpy [rad].
PUBLISHED_PLACEMENTS = """
base_footprint base_link 0 0 0.0985 0 0 0
base_footprint base_cover_link 0 0 0.13 0 0 0
base_link base_laser_link 0.202 0 -0.004 0 0 0
base_link base_imu_link 0.10171 0 0.11282 0 0 -H
base_link wheel_right_link 0 -0.2022 0 -H 0 0
base_link wheel_left_link 0 0.2022 0 -H 0 0
base_link caster_front_right_1_link 0.1695 -0.102 -0.0335 0 0 0
base_link caster_front_left_1_link 0.1695 0.102 -0.0335 0 0 0
base_link caster_back_right_1_link -0.1735 -0.102 -0.0335 0 0 0
base_link caster_back_left_1_link -0.1735 0.102 -0.0335 0 0 0
caster_front_right_1_link caster_front_right_2_link -0.016 0 -0.04 -H 0 0
caster_front_left_1_link caster_front_left_2_link -0.016 0 -0.04 -H 0 0
caster_back_right_1_link caster_back_right_2_link -0.016 0 -0.04 -H 0 0
caster_back_left_1_link caster_back_left_2_link -0.016 0 -0.04 -H 0 0
base_link torso_fixed_link -0.062 0 0.193 0 0 0
torso_fixed_link torso_lift_link 0 0 0.597 0 0 0
torso_lift_link head_1_link 0.182 0 0 0 0 0
head_1_link head_2_link 0.005 0 0.098 H 0 0
head_2_link xtion_link 0.0908 0.08 0 -H 0 0
torso_lift_link arm_1_link 0.15505 0.014 -0.151 0 0 -H
arm_1_link arm_2_link 0.125 0.0195 -0.031 H 0 0
arm_2_link arm_3_link 0.0895 0 -0.0015 -H 0 H
arm_3_link arm_4_link -0.02 -0.027 -0.222 -H -H 0
arm_4_link arm_5_link -0.162 0.02 0.027 H -H -H
arm_5_link arm_6_link 0 0 0.15 0 -H -H
arm_6_link arm_7_link 0 0 0 H 0 H
arm_7_link arm_tool_link 0 0 0.046 H -H P
arm_tool_link wrist_ft_link 0.00785 0 0 H 0 H
wrist_ft_link wrist_ft_tool_link 0 0 0.012725 -H -H 0
wrist_ft_tool_link gripper_link 0.01 0 0 H H -H
gripper_link gripper_right_finger_link 0 0 0 0 0 0
gripper_link gripper_left_finger_link 0 0 0 0 0 0
gripper_link gripper_base_link 0 0 0 0 3.1416 1.5707
gripper_base_link gripper_grasping_frame 0 0 0.12 0 -H 0
"""


# Joint: lower, upper [rad, m] (None: turns for ever), velocity [rad/s, m/s], effort [N m, N].
PUBLISHED_LIMITS = {
    "torso_lift_joint": (0.0, 0.35, 0.07, 2000.0),
    "head_1_joint": (-5 * math.pi / 12, 5 * math.pi / 12, 3.0, 5.197),
    "head_2_joint": (-math.pi / 3, math.pi / 4, 3.0, 2.77),
    "arm_1_joint": (0.0, 7 * math.pi / 8, 1.95, 43.0),
    "arm_2_joint": (-HALF_PI, 1.090830782496456, 1.95, 43.0),
    "arm_3_joint": (-3.5342917352885173, HALF_PI, 2.35, 26.0),
    "arm_4_joint": (-math.pi / 8, 3 * math.pi / 4, 2.35, 26.0),
    "arm_5_joint": (-2 * math.pi / 3, 2 * math.pi / 3, 1.95, 3.0),
    "arm_6_joint": (-1.413716694115407, 1.413716694115407, 1.76, 6.6),
    "arm_7_joint": (-2 * math.pi / 3, 2 * math.pi / 3, 1.76, 6.6),
    "gripper_right_finger_joint": (0.0, 0.045, 0.05, 64.0),
    "gripper_left_finger_joint": (0.0, 0.045, 0.05, 64.0),
    "wheel_right_joint": (None, None, 1.0 / 0.0985, 6.0),
    "wheel_left_joint": (None, None, 1.0 / 0.0985, 6.0),
}


ARM = [f"arm_{k}_joint" for k in range(1, 8)]


def test_the_robot_weighs_what_the_plate_read(model):
    mass = model.body_subtreemass[model.body(mjcf.ROOT).id]
    assert 73.0 < mass < 74.5
    assert model.body_mass.sum() == pytest.approx(mass, abs=1e-12), "the laboratory must weigh nothing"
    assert mass + 0.437 == pytest.approx(74.4, abs=0.05)


def test_placements_are_the_published_ones(model):
    lines = PUBLISHED_PLACEMENTS.split("\n")[1:-1]
    for line in lines:
        parent, child, *numbers = line.split()
        values = [float(in_pi(word)) for word in numbers]
        body = model.body(child)
        assert model.body(body.parentid[0]).name == parent
        R = np.empty(9)
        mujoco.mju_quat2Mat(R, body.quat)
        np.testing.assert_allclose(body.pos, values[:3], rtol=0, atol=1e-15, err_msg=child)
        np.testing.assert_allclose(R.reshape(3, 3), pin.rpy.rpyToMatrix(*values[3:]), rtol=0, atol=5e-15, err_msg=child)
    assert len(lines) == len(robot_bodies(model)) - 1


def in_pi(word: str) -> float:
    """Return a number of the table, H standing for pi/2 and P for pi."""
    sign, letter = (-1.0, word[1:]) if word.startswith("-") else (1.0, word)
    return sign * {"H": HALF_PI, "P": math.pi}[letter] if letter in "HP" else float(word)


def test_limits_are_the_published_ones_everywhere(model, pin_model):
    in_urdf = {joint.get("name"): joint.find("limit") for joint in ET.fromstring(mjcf.urdf()).iter("joint")}
    for name, (lower, upper, velocity, effort) in PUBLISHED_LIMITS.items():
        joint, pin_joint = model.joint(name), pin_model.joints[pin_model.getJointId(name)]
        bounds = () if lower is None else (lower, upper)
        assert tuple(float(in_urdf[name].get(key)) for key in ("velocity", "effort")) == (velocity, effort), name
        assert (joint.user[0], *model.jnt_actfrcrange[joint.id]) == (velocity, -effort, effort), name
        assert (pin_model.velocityLimit[pin_joint.idx_v], pin_model.effortLimit[pin_joint.idx_v]) == (velocity, effort)
        assert bool(model.jnt_limited[joint.id]) == bool(bounds), name
        if bounds:
            at = pin_joint.idx_q
            np.testing.assert_allclose(joint.range, bounds, rtol=0, atol=1e-15, err_msg=name)
            assert tuple(joint.range) == (pin_model.lowerPositionLimit[at], pin_model.upperPositionLimit[at]), name
    unlimited = [joint.name for joint in joints(model) if joint.name not in PUBLISHED_LIMITS]
    assert len(unlimited) == 8 and all(name.startswith("caster") and in_urdf[name] is None for name in unlimited)


def test_axes_go_through_the_link_origins(model):
    assert not np.any([joint.pos for joint in joints(model)])
    axes = {tuple(joint.axis) for joint in joints(model) if "finger" not in joint.name}
    assert axes == {(0.0, 0.0, 1.0)}


def test_the_nominal_robot_has_no_rotor_inertia(model):
    assert not np.any(model.dof_armature)


def test_every_inertia_could_be_that_of_a_real_body(model):
    for body in robot_bodies(model):
        if body.mass[0] > 0.0:
            principal = body.inertia
            spread = principal.sum() / 2 - principal
            assert principal.min() > 0.0, body.name
            assert spread.min() > 1e-3 * principal.max(), f"{body.name}: {principal} breaks the triangle inequality"
        else:
            assert model.body_weldid[body.id] != body.id or body.name == mjcf.ROOT, f"{body.name} moves without mass"


def test_urdf_inertias_are_the_written_ones(model):
    links = {link.get("name"): link for link in ET.fromstring(mjcf.urdf()).iter("link")}
    for body in mjcf.spec().bodies:
        inertial = links[body.name].find("inertial") if body.name in links else None
        if inertial is None:
            continue
        found = [float(inertial.find("inertia").get(key)) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")]
        np.testing.assert_allclose(found, body.fullinertia, rtol=0, atol=1e-14 * max(found), err_msg=body.name)
        assert [float(x) for x in inertial.find("origin").get("xyz").split()] == list(body.ipos)
        assert float(inertial.find("mass").get("value")) == body.mass


def test_centres_of_mass_lie_between_their_joints(model):
    """The published signs put the masses of arm_1 and arm_5 on the side their links do not extend to."""
    for body, child in (("arm_1_link", "arm_2_link"), ("arm_5_link", "arm_6_link"), ("arm_4_link", "arm_5_link")):
        assert np.dot(model.body(body).ipos, model.body(child).pos) > 0.0
    assert model.body("arm_1_link").ipos[1] > 0.0


def test_fingers_are_one_part_turned_by_half_a_turn(model):
    half_turn = np.diag([-1.0, -1.0, 1.0])
    right, left = (model.body(f"gripper_{side}_finger_link") for side in ("right", "left"))
    np.testing.assert_array_equal(half_turn @ right.ipos, left.ipos)
    tensors = []
    for body in (right, left):
        R = np.empty(9)
        mujoco.mju_quat2Mat(R, body.iquat)
        tensors.append(R.reshape(3, 3) @ np.diag(body.inertia) @ R.reshape(3, 3).T)
    np.testing.assert_allclose(half_turn @ tensors[0] @ half_turn, tensors[1], atol=1e-17)


def arm_torques_and_reach(model, n):
    """Return the largest gravity torque of each arm joint [N m] and the reach arm_1 -> wrist_ft_tool [m]."""
    rng, data = np.random.default_rng(0), mujoco.MjData(model)
    arm = [model.joint(name) for name in ARM]
    torque, reach = np.zeros(7), 0.0
    for _ in range(n):
        for joint in arm:
            data.qpos[joint.qposadr] = rng.uniform(*joint.range)
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        torque = np.maximum(torque, np.abs([data.qfrc_bias[joint.dofadr[0]] for joint in arm]))
        reach = max(reach, np.linalg.norm(data.body("wrist_ft_tool_link").xpos - data.body("arm_1_link").xpos))
    return torque, reach


def test_statics_are_those_computed_from_the_published_urdf():
    """With the published centres of mass put back, the published URDF's gravity torques come out."""
    spec = mjcf.spec()
    spec.body("arm_5_link").ipos[2] *= -1.0
    spec.body("gripper_left_finger_link").ipos = spec.body("gripper_right_finger_link").ipos
    torque, reach = arm_torques_and_reach(spec.compile(), 4000)
    assert torque[0] < 1e-9
    np.testing.assert_allclose(torque[1:4], [24.4, 8.7, 8.0], rtol=0.03)
    np.testing.assert_allclose(torque[4:], [1.2, 1.2, 0.03], rtol=0.1)
    assert reach == pytest.approx(0.82, abs=0.005)


def test_grasping_frame_is_straight_ahead_of_the_wrist(model):
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    wrist, grasp = data.body("arm_7_link"), data.body("gripper_grasping_frame")
    p = wrist.xmat.reshape(3, 3).T @ (grasp.xpos - wrist.xpos)
    np.testing.assert_allclose(p, [0.0, 0.0, 0.196575], atol=2e-6)
