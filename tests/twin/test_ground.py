import importlib
import json
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from scenarios import load
from twin import motions, truth
from twin.campaign import laboratory
from twin.simulate import simulate


@pytest.fixture(scope="module")
def config():
    return load("humanoids2024", ["twin.base.wheels=anchored"]).quick().twin


@pytest.fixture(scope="module")
def anchored(config):
    return laboratory(config, 0)


def swing(config, name="around_z", duration=3.0):
    path = motions.CALIBRATION_SWINGS[name]
    return motions.swing(name, "calibration", "swing", path, duration, config.campaign)


def test_an_anchored_base_comes_back_to_where_it_stood(anchored, config):
    campaign = replace(config.campaign, rest=4.0)
    there_and_back = motions.swing("z", "calibration", "swing", motions.CALIBRATION_SWINGS["around_z"], 5.12, campaign)
    states = simulate(anchored.twin, there_and_back, anchored.T_lab_base)
    T = np.linalg.solve(states.poses["base_footprint"][500], states.poses["base_footprint"])
    moved, left = np.abs(T[:, :3, 3]).max(), np.abs(T[-1, :3, 3]).max()
    assert moved > 2e-4
    assert left < 0.02 * moved


def test_an_anchored_base_presses_on_the_plate_with_its_weight(anchored, config):
    states = simulate(anchored.twin, swing(config), anchored.T_lab_base)
    weight = 9.81 * anchored.twin.model.body_mass.sum()
    still = states.t < 1.0
    np.testing.assert_allclose(states.wrench[still, 2].mean(), -weight, rtol=1e-4)
    np.testing.assert_allclose(states.wrench[still, :2].mean(axis=0), 0.0, atol=0.1)


def test_infinite_stiffness_is_null_in_a_file(tmp_path):
    truth.write_parameters(tmp_path / "truth.json", [], {"K": np.diag([np.inf, 2.0])})
    assert json.loads((tmp_path / "truth.json").read_text())["derived"]["K"] == [[None, 0.0], [0.0, 2.0]]


def momentum(model, states, centre):
    """Momentum and moment of momentum (n, 6) of the robot about a point, and its centre of mass times mass (n, 3).

    By MuJoCo's subtree quantities on the states alone: no contact, no sensor.
    """
    data, rows = mujoco.MjData(model), []
    base, nq = model.body("base_footprint").id, model.nq
    mass = model.body_subtreemass[base]
    for state in states:
        data.qpos[:], data.qvel[:] = state[1 : 1 + nq], state[1 + nq : 1 + nq + model.nv]
        for step in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_comVel, mujoco.mj_subtreeVel):
            step(model, data)
        r, p = data.subtree_com[base] - centre, mass * data.subtree_linvel[base]
        rows.append([*p, *(data.subtree_angmom[base] + np.cross(r, p)), *(mass * r)])
    found = np.array(rows)
    return found[:, :6], found[:, 6:]


@pytest.mark.parametrize("ground", ["contact", "anchored"])
def test_the_plate_reads_weight_and_rate_of_momentum(ground, monkeypatch):
    config = load("humanoids2024", [f"twin.base.wheels={ground}"]).quick().twin
    lab, seen = laboratory(config, 0), {}
    module = importlib.import_module("twin.simulate")
    unpack = module._unpack

    def kept(model, links, states, sensors, command):
        seen["model"], seen["states"] = model, states
        return unpack(model, links, states, sensors, command)

    monkeypatch.setattr(module, "_unpack", kept)
    motion = motions.swing("v", "validation", "swing", motions.VALIDATION_SWINGS["xyz"], 2.0, config.campaign)
    found = simulate(lab.twin, motion, lab.T_lab_base)
    model, step, n = seen["model"], config.timestep, 10
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    p, mr = momentum(model, seen["states"], data.site("plate").xpos)
    start = np.arange(0, len(p) - n, n)
    rate = (p[start + n] - p[start]) / (n * step)
    mean = [np.mean([a[i : i + n] for i in start], axis=1) for a in (mr, found.wrench)]
    mass = model.body_subtreemass[model.body("base_footprint").id]
    weight = np.hstack([np.tile(mass * model.opt.gravity, (len(start), 1)), np.cross(mean[0], model.opt.gravity)])
    error = np.sqrt(np.mean((mean[1] - (weight - rate)) ** 2, axis=0))
    print("rms", error)
    assert np.ptp(found.wrench[:, 2]) > 30.0
    assert (error < 0.1).all()


def test_sensed_poses_are_those_of_their_state(lab, config):
    """A pose a step old would be off by speed times step; angles of the same instant give it back to rounding."""
    states = simulate(lab.twin, swing(config, duration=2.0), lab.T_lab_base)
    model, data = lab.twin.model, mujoco.MjData(lab.twin.model)
    k = int(np.argmax(np.abs(np.gradient(states.link[:, 1]))))
    for joint, angle in zip(motions.JOINTS, states.link[k], strict=True):
        data.joint(joint).qpos = angle
    mujoco.mj_kinematics(model, data)
    T = {n: np.eye(4) for n in ("torso_lift_link", "arm_7_link")}
    T_lab = states.poses
    torso, hand = "torso_lift_link", "gripper_grasping_frame"
    for name in (torso, hand):
        T[name] = np.eye(4)
        T[name][:3, :3], T[name][:3, 3] = data.body(name).xmat.reshape(3, 3), data.body(name).xpos
    expected = np.linalg.solve(T[torso], T[hand])
    seen = np.linalg.solve(T_lab[torso][k], T_lab[hand][k])
    late = np.linalg.solve(T_lab[torso][k + 1], T_lab[hand][k + 1])
    assert np.abs(late - expected)[:3, 3].max() > 1e-4
    np.testing.assert_allclose(seen, expected, atol=1e-9)
