"""MuJoCo and Pinocchio read the same robot."""

import math

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import mjcf
from tests.mjcf.elements import joints, robot_bodies


def random_configuration(rng, model, pin_model):
    """Return the same random configuration for both: root pose anywhere, every joint within its range."""
    qpos, q = np.zeros(model.nq), pin.neutral(pin_model)
    quat_xyzw = rng.normal(size=4)
    quat_xyzw /= np.linalg.norm(quat_xyzw)
    qpos[:3] = q[:3] = rng.uniform(-2.0, 2.0, 3)
    qpos[3:7], q[3:7] = np.roll(quat_xyzw, 1), quat_xyzw
    for joint in joints(model):
        low, high = joint.range if model.jnt_limited[joint.id] else (-math.pi, math.pi)
        angle = rng.uniform(low, high)
        qpos[joint.qposadr] = angle
        pin_joint = pin_model.joints[pin_model.getJointId(joint.name)]
        turns_for_ever = pin_joint.nq == 2
        q[pin_joint.idx_q : pin_joint.idx_q + pin_joint.nq] = (
            [math.cos(angle), math.sin(angle)] if turns_for_ever else angle
        )
    return qpos, q


def velocity_map(model, pin_model, R_world_base):
    """Return G with v_mujoco = G v_pinocchio: other joint order, root's linear velocity in the world's axes."""
    G = np.zeros((model.nv, pin_model.nv))
    G[:3, :3], G[3:6, 3:6] = R_world_base, np.eye(3)
    for joint in joints(model):
        G[joint.dofadr[0], pin_model.joints[pin_model.getJointId(joint.name)].idx_v] = 1.0
    return G


@pytest.fixture(scope="module")
def parity(model, pin_model):
    """Worst differences between the two engines over 1,000 random configurations."""
    rng = np.random.default_rng(7)
    data, pin_data = mujoco.MjData(model), pin_model.createData()
    body_ids = [body.id for body in robot_bodies(model)]
    frame_ids = [pin_model.getFrameId(model.body(i).name) for i in body_ids]
    M = np.zeros((model.nv, model.nv))
    worst = {"position": 0.0, "rotation": 0.0, "inertia": 0.0, "gravity": 0.0}
    for _ in range(1000):
        qpos, q = random_configuration(rng, model, pin_model)
        data.qpos[:] = qpos
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fullM(model, data, M)
        pin.framesForwardKinematics(pin_model, pin_data, q)
        poses = [pin_data.oMf[i] for i in frame_ids]
        G = velocity_map(model, pin_model, data.body(mjcf.ROOT).xmat.reshape(3, 3))
        M_pin = np.triu(pin.crba(pin_model, pin_data, q))
        M_pin = M_pin + np.triu(M_pin, 1).T
        scale = np.sqrt(np.diag(M_pin))
        gravity = pin.computeGeneralizedGravity(pin_model, pin_data, q)
        found = {
            "position": data.xpos[body_ids] - [pose.translation for pose in poses],
            "rotation": data.xmat[body_ids].reshape(-1, 3, 3) - [pose.rotation for pose in poses],
            "inertia": (G.T @ M @ G - M_pin) / np.outer(scale, scale),
            "gravity": (G.T @ data.qfrc_bias - gravity) / (np.linalg.norm(pin_model.gravity.linear) * scale[0] ** 2),
        }
        for name, difference in found.items():
            worst[name] = max(worst[name], float(np.abs(difference).max()))
    return worst


def test_every_frame_is_where_pinocchio_puts_it(parity):
    assert parity["position"] <= 1e-9
    assert parity["rotation"] <= 1e-9


def test_joint_space_inertia_is_pinocchios(parity):
    assert parity["inertia"] <= 1e-9


def test_gravity_torques_are_pinocchios(parity):
    assert parity["gravity"] <= 1e-9


def test_pinocchio_reads_the_same_mass_joints_and_links(model, pin_model):
    assert abs(pin.computeTotalMass(pin_model) - model.body_subtreemass[model.body(mjcf.ROOT).id]) <= 1e-9
    assert set(pin_model.names) == {"universe", "root_joint"} | {joint.name for joint in joints(model)}
    links = {frame.name for frame in pin_model.frames if frame.type == pin.FrameType.BODY}
    assert links == {body.name for body in robot_bodies(model)}
