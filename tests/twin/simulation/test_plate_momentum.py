"""Plate wrench = weight + rate of momentum, and every sensed value belongs to the state beside it."""

import mujoco
import numpy as np
import pytest
from mujoco import rollout

from scenarios import load
from twin import motions
from twin.campaign import laboratory
from twin.motions import JOINTS, VALIDATION_SWINGS
from twin.simulation import simulate
from twin.simulation.setpoints import prepare

SAMPLE = 10  # steps of a plate sample of 10 ms


@pytest.fixture(scope="module", params=["contact", "anchored", "rigid"])
def trial(request):
    """A laboratory, a swing with jolts, and the states it goes through."""
    config = load("humanoids2024", [f"twin.base.wheels={request.param}"]).quick().twin
    lab = laboratory(config, 0)
    motion = motions.swing("v", "validation", "swing", VALIDATION_SWINGS["xyz"], 2.0, config.campaign)
    inputs = prepare(lab.twin, motion, lab.T_lab_base)
    after, _ = rollout.rollout(inputs.model, mujoco.MjData(inputs.model), inputs.first[None], inputs.control[None])
    states = np.concatenate([inputs.first[None], after[0, :-1]])[inputs.settling :]
    return inputs.model, states, simulate(lab.twin, motion, lab.T_lab_base)


def momentum(model, states, about):
    """Of the robot (n, 6) about a point, and its mass times centre of mass from there (n, 3).

    By the states and masses alone: neither a contact nor a sensor.
    """
    data, base, rows = mujoco.MjData(model), model.body("base_footprint").id, []
    mass = model.body_subtreemass[base]
    for state in states:
        data.qpos[:], data.qvel[:] = np.split(state[1 : 1 + model.nq + model.nv], [model.nq])
        for compute in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_comVel, mujoco.mj_subtreeVel):
            compute(model, data)
        r, p = data.subtree_com[base] - about, mass * data.subtree_linvel[base]
        rows.append([*p, *(data.subtree_angmom[base] + np.cross(r, p)), *(mass * r)])
    return np.split(np.array(rows), [6], axis=1)


def imbalance(trial, n, shift=0):
    """Rms (6,) of wrench - weight + rate of momentum, averaged over samples of n steps."""
    model, states, found = trial
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    p, mr = momentum(model, states, data.site("plate").xpos)
    rows = np.arange(n, len(p) - 2 * n, n)
    rate = (p[rows + n] - p[rows]) / (n * model.opt.timestep)
    wrench, mr = (np.mean([a[i : i + n] for i in rows], axis=1) for a in (np.roll(found.wrench, shift, axis=0), mr))
    g = model.opt.gravity
    weight = np.hstack(
        [np.tile(model.body_subtreemass[model.body("base_footprint").id] * g, (len(mr), 1)), np.cross(mr, g)]
    )
    return np.sqrt(np.mean((wrench - weight + rate) ** 2, axis=0))


def test_the_plate_reads_weight_and_rate_of_momentum(trial, claim, request):
    error = imbalance(trial, SAMPLE)
    claim(f"physics/momentum/{request.node.callspec.params['trial']}", error)
    assert np.ptp(trial[2].wrench[:, 2]) > 30.0
    assert (error < 0.1).all()


def test_a_wrench_is_that_of_its_state(trial):
    error, late = imbalance(trial, 1), imbalance(trial, 1, shift=1)
    print("rms", error, "a step late", late)
    assert (error < 0.5 * late).all()


def test_a_sensed_pose_is_that_of_its_state(trial):
    """The hand at the fastest instant, from the joint positions of the same row, is given back to rounding."""
    model, states, found = trial
    k = int(np.argmax(np.abs(np.gradient(found.link[:, 1]))))
    data = mujoco.MjData(model)
    data.qpos[:] = states[k, 1 : 1 + model.nq]
    mujoco.mj_kinematics(model, data)
    p = data.body("gripper_grasping_frame").xpos
    seen = found.poses["gripper_grasping_frame"][:, :3, 3]
    assert np.linalg.norm(seen[k + 1] - p) > 1e-4
    np.testing.assert_allclose(seen[k], p, atol=1e-12)
    np.testing.assert_array_equal(found.link[k], [data.joint(j).qpos[0] for j in JOINTS])
