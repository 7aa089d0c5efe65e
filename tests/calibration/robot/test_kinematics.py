"""Kinematics of all postures at once, against Pinocchio one by one."""

import numpy as np
import pinocchio as pin
import pytest

import mjcf
from calibration.errors import InputError
from calibration.numerics.lie import exp6, jexp6, jlog6, log3, log6
from calibration.recording.schema import Description
from calibration.robot.chain import chain_of, chain_of_frames
from calibration.robot.laboratory import floating_model
from tests.calibration.robot.test_chain import OTHER_ROBOT, derivatives, other_chain
from tests.doubles import rigid_robot

ANGLES = (0.0, 1e-9, 1e-4, 0.3, 0.499, 0.501, 1.0, 2.9, 3.1)


def heavy_chain():
    """The other robot with masses, its base turned, sliding joint last."""
    inertial = """<inertial><mass value="2.5"/><origin xyz="0.1 -0.2 0.3"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"""
    urdf = OTHER_ROBOT
    for link in "bcde":
        urdf = urdf.replace(f'<link name="{link}"/>', f'<link name="{link}">{inertial}</link>')
    turned = """<link name="z"/><joint name="mount" type="fixed"><parent link="z"/><child link="a"/>
    <origin xyz="0 0 1" rpy="0.3 0.2 0.1"/></joint>"""
    return chain_of_frames(
        urdf.replace('<link name="a"/>', f'<link name="a"/>{turned}'), ("slide", "spin", "tilted"), "a", "e"
    )


def twists(angle, n=50):
    x = np.random.default_rng(1).normal(size=(n, 6))
    x[:, 3:] *= angle / np.linalg.norm(x[:, 3:], axis=1)[:, None]
    return x


@pytest.mark.parametrize("angle", ANGLES)
def test_exponential_and_logarithm_are_pinocchio_s_and_inverse(angle):
    x = twists(angle)
    T = exp6(x)
    expected = np.array([pin.exp6(pin.Motion(row)).homogeneous for row in x])
    np.testing.assert_allclose(T, expected, atol=1e-12)
    np.testing.assert_allclose(log6(T), x, atol=1e-12)


@pytest.mark.parametrize("angle", [a for a in ANGLES if not 0.0 < a < 0.3])
def test_the_derivative_of_the_logarithm_is_pinocchio_s(angle):
    x = twists(angle)
    expected = np.array([pin.Jlog6(pin.exp6(pin.Motion(row))) for row in x])
    np.testing.assert_allclose(jlog6(x), expected, atol=1e-12)


def test_the_derivative_of_the_logarithm_at_small_angles_is_its_series():
    # Pinocchio's own loses seven digits near 1e-3 rad; there log6's derivative is I + ad/2 + ad^2/12 to 1e-12.
    for x in np.concatenate([twists(1e-9, 5), twists(1e-4, 5), twists(1e-3, 5)]):
        ad = pin.Motion(x).action
        np.testing.assert_allclose(jlog6(x), np.eye(6) + ad / 2 + ad @ ad / 12, atol=1e-11)
        np.testing.assert_allclose(jexp6(x) @ jlog6(x), np.eye(6), atol=1e-14)


def test_a_turn_of_almost_pi_has_an_axis():
    w = (np.pi - 1e-7) * np.array([[0.6, 0.0, 0.8], [0.0, -1.0, 0.0]])
    np.testing.assert_allclose(log3(exp6(np.hstack([0.0 * w, w]))[:, :3, :3]), w, atol=1e-7)


@pytest.mark.parametrize("robot", ["tiago", "other"])
def test_poses_and_derivatives_of_all_configurations_are_pinocchio_s(chain, robot):
    c = chain if robot == "tiago" else other_chain()
    rng = np.random.default_rng(2)
    c = c.with_placements(0.05 * rng.normal(size=c.xi.shape))
    q = rng.uniform(-1.0, 1.0, size=(40, len(c.measured)))
    (by_placement, by_joint), model, data = derivatives(c, q), c.model, c.model.createData()
    tool, ids = model.getFrameId(c.tool_frame), [model.getJointId(name) for name in c.joints]
    velocities = [model.joints[i].idx_v for i in ids]
    for k, row in enumerate(c.configurations(q)):
        pin.framesForwardKinematics(model, data, row)
        T = data.oMf[model.getFrameId(c.base_frame)].actInv(data.oMf[tool]).homogeneous
        regressor = pin.computeFrameKinematicRegressor(model, data, tool, pin.LOCAL)
        right = [pin.Jexp6(pin.Motion(xi)) for xi in c.xi]
        J = np.hstack([regressor[:, 6 * (i - 1) : 6 * i] @ e for i, e in zip(ids, right, strict=True)])
        np.testing.assert_allclose(c.poses(q)[k], T, atol=1e-12)
        np.testing.assert_allclose(by_placement[k], J, atol=1e-12)
        jacobian = pin.computeFrameJacobian(model, data, row, tool, pin.LOCAL)
        np.testing.assert_allclose(by_joint[k], jacobian[:, velocities], atol=1e-12)


def test_a_frame_on_the_way_is_where_pinocchio_has_it(chain):
    moved = chain.with_placements(0.02 * np.ones(chain.xi.shape))
    q = rigid_robot.random_angles(np.random.default_rng(3), 5)
    model, data = moved.model, moved.model.createData()
    for k, row in enumerate(moved.configurations(q)):
        pin.framesForwardKinematics(model, data, row)
        T = data.oMf[model.getFrameId("base_footprint")].actInv(data.oMf[model.getFrameId("arm_4_link")])
        np.testing.assert_allclose(moved.poses(q, "arm_4_link")[k], T.homogeneous, atol=1e-12)


def test_a_joint_of_several_freedoms_is_refused():
    urdf = """<robot name="r"><link name="a"/><link name="b"/><joint name="plane" type="planar"><parent link="a"/>
    <child link="b"/><axis xyz="0 0 1"/></joint></robot>"""
    with pytest.raises(InputError, match="more than one degree of freedom"):
        chain_of_frames(urdf, ("plane",), "a", "b")


@pytest.mark.parametrize("robot", ["tiago", "other"])
def test_gravity_torques_of_all_configurations_are_pinocchio_s(chain, robot):
    c = chain if robot == "tiago" else heavy_chain()
    q = np.random.default_rng(4).uniform(-1.0, 1.0, size=(20, len(c.measured)))
    model, data = c.nominal, c.nominal.createData()
    ids = [model.joints[model.getJointId(name)].idx_v for name in c.joints]
    expected = [pin.computeGeneralizedGravity(model, data, row)[ids] for row in c.configurations(q)]
    assert np.abs(expected).max() > 1.0
    np.testing.assert_allclose(c.gravity_torques(q), expected, atol=1e-12)


def test_gravity_torques_are_those_of_the_floating_model_with_payload_and_gravity_of_the_description():
    data = rigid_robot.description([], gravity=[0.3, -0.2, -9.7], payload={
        "link": "gripper_grasping_frame", "mass": 2.0, "com": [0.01, 0.02, 0.1], "tolerance": 0.1,
    })  # fmt: skip
    described = Description.model_validate(data)
    c, model = chain_of(mjcf.urdf(), described), floating_model(mjcf.urdf(), described)
    q, data = rigid_robot.random_angles(np.random.default_rng(5), 6), model.createData()
    ids = [model.joints[model.getJointId(name)].idx_v for name in c.measured]
    for row, tau in zip(q, c.gravity_torques(q), strict=True):
        v = np.zeros(model.nv)
        v[ids] = row
        expected = pin.computeGeneralizedGravity(model, data, pin.integrate(model, pin.neutral(model), v))[ids]
        np.testing.assert_allclose(tau, expected[[c.measured.index(j) for j in c.joints]], atol=1e-12)
    lighter = described.carrying(0.5)
    np.testing.assert_allclose(
        c.carrying(0.5).gravity_torques(q), chain_of(mjcf.urdf(), lighter).gravity_torques(q), atol=1e-12
    )
    assert np.abs(c.gravity_torques(q) - c.carrying(0.0).gravity_torques(q)).max() > 1.0
