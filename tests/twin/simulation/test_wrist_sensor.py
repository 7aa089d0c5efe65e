"""The wrist's force-torque sensor: weight, momentum, and a push that no model of the robot knows of."""

import mujoco
import numpy as np
import pytest
from mujoco import rollout
from scipy.spatial.transform import Rotation

import mjcf
from twin.fields.names import HAND
from twin.motions import CALIBRATION_SWINGS, motion
from twin.simulation import build, simulate, wrist_sensor
from twin.simulation.setpoints import prepare
from twin.simulation.wrist_sensor import RigidBodyInertia

FELT = (mujoco.mjtSensor.mjSENS_FORCE, mujoco.mjtSensor.mjSENS_TORQUE)


@pytest.fixture(scope="module")
def swing(config):
    return motion.swing("swing", "calibration", "swing", CALIBRATION_SWINGS["x_fold"], 4.0, config.campaign)


@pytest.fixture(scope="module")
def states(lab, swing):
    return simulate(lab.twin, swing, lab.T_lab_base)


def test_it_bears_the_weight_of_the_hand_in_its_own_axes(lab, states):
    model = build(mjcf.spec(), lab.robot.defects, visual=True).model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    sensor, held, grasp = data.body("wrist_ft_link"), model.body("wrist_ft_tool_link").id, data.body(HAND)
    R_sensor_grasp = sensor.xmat.reshape(3, 3).T @ grasp.xmat.reshape(3, 3)
    lever = sensor.xmat.reshape(3, 3).T @ (data.subtree_com[held] - sensor.xpos)
    down = R_sensor_grasp @ states.poses[HAND][0, :3, :3].T @ [0.0, 0.0, -1.0]
    weight = 9.81 * model.body_subtreemass[held] * down
    expected = np.concatenate([weight, np.cross(lever, weight)])
    np.testing.assert_allclose(states.wrist[0], expected, atol=1e-2)
    assert np.abs(expected[:3]).min() > 1.0 and np.abs(expected[3:]).max() > 0.5


def test_a_swing_feels_like_to_mujoco_s_own_sensor(lab, swing, states, monkeypatch):
    ours = wrist_sensor.add_wrist

    def with_mujoco_s(spec):
        ours(spec)
        for kind in FELT:
            spec.add_sensor(name=kind.name, type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="wrist")

    monkeypatch.setattr(wrist_sensor, "add_wrist", with_mujoco_s)
    twin = build(mjcf.spec(), lab.robot.defects, lab.twin.links)
    inputs = prepare(twin, swing, lab.T_lab_base)
    model = inputs.model
    _, sensors = rollout.rollout(model, mujoco.MjData(model), inputs.first[None], inputs.control[None])
    expected = -wrist_sensor.sensed(model, sensors[0][inputs.settling :], [kind.name for kind in FELT])
    off = np.sqrt(((states.wrist - expected)[:-1] ** 2).mean(axis=0))
    span = np.ptp(expected, axis=0)
    assert (span > [4.0, 4.0, 4.0, 0.3, 0.3, 0.3]).all()
    assert (off < 2e-3 * span).all()


def test_a_push_on_the_hand_loads_the_arm(lab, config):
    pushed = simulate(lab.twin, motion.pushed("push", "validation", 20.0, config.campaign), lab.T_lab_base)
    data, model = mujoco.MjData(lab.twin.model), lab.twin.model
    mujoco.mj_kinematics(model, data)
    R = data.site("wrist").xmat.reshape(3, 3).T @ data.site("push").xmat.reshape(3, 3)
    lever = data.site("wrist").xmat.reshape(3, 3).T @ (data.site("push").xpos - data.site("wrist").xpos)
    plate_sites = pushed.wrist - pushed.wrist[:900].mean(axis=0)
    for axis in range(3):
        f = -20.0 * R[:, axis]
        plateau = np.linalg.norm(plate_sites[:, :3] - f, axis=1) < 1.0
        assert plateau.sum() > 1500, "for two seconds, but for what the hand is turned by it"
        np.testing.assert_allclose(plate_sites[plateau, 3:].mean(axis=0), np.cross(lever, f), atol=0.15)


def test_a_spinning_top_asks_for_no_more_than_its_weight_and_gyration():
    """A body on a turntable: w x (I w) and the centripetal force, in closed form."""
    top, rate, step = RigidBodyInertia(2.0, np.array([0.1, 0.0, 0.05]), np.diag([0.01, 0.02, 0.03])), 3.0, 1e-4
    angle = rate * step * np.arange(1000)
    R = Rotation.from_rotvec(np.outer(angle, [0.0, 0.0, 1.0])).as_matrix()
    w = np.tile([0.0, 0.0, rate], (1000, 1))
    found = top.wrench(R, np.zeros((1000, 3)), w, np.array([0.0, 0.0, -9.81]), step)[500]
    F = np.array([-2.0 * 0.1 * rate**2, 0.0, 2.0 * 9.81])
    np.testing.assert_allclose(found, [*F, *np.cross(top.centre, F)], atol=1e-3)
