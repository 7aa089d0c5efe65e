import subprocess
import sys
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from twin.motions import CALIBRATION_SWINGS, JOINTS, motion
from twin.simulation import Twin, simulate


@pytest.fixture(scope="module")
def sweep(config):
    """arm_7 back and forth: its axis is loaded by nothing but friction, so that its play shows whole."""
    return motion.swing("s", "calibration", "sweep", motion.sweep_path("arm_7_joint", 4.0), 4.0, config.campaign)


@pytest.fixture(scope="module")
def states(lab, sweep):
    return simulate(lab.twin, sweep, lab.T_lab_base)


def with_model(twin: Twin, edit) -> Twin:
    model = mujoco.MjModel.__copy__(twin.model)
    edit(model)
    return Twin(model, twin.truth, twin.links)


def test_play_is_read_back_from_motor_and_link_angles(lab, states):
    truth = {p.name: p.value for p in lab.twin.truth}
    gap, friction = truth["backlash.arm_7_joint.gap"], truth["friction.arm_7_joint.coulomb"]
    windup = 2.0 * friction * truth["gear.arm_7_joint.compliance"]
    moving = (states.t > 2.0) & (states.t < 5.0)
    low, high = np.percentile((states.motor - states.link)[moving, 7], [5.0, 95.0])
    print(high - low, gap, windup)
    assert high - low == pytest.approx(gap + windup, abs=3e-4)


def test_play_lives_in_the_compiled_model(lab, sweep, states):
    def close(model):
        model.tendon_range[model.tendon("arm_7_joint.mesh").id] = -1e-9, 1e-9

    tight = simulate(with_model(lab.twin, close), sweep, lab.T_lab_base)
    assert np.ptp((tight.motor - tight.link)[:, 7]) < 0.15 * np.ptp((states.motor - states.link)[:, 7])


def test_base_motion_lives_in_the_compiled_model(lab, config):
    path = CALIBRATION_SWINGS["around_z"]
    swing = motion.swing("z", "calibration", "swing", path, 3.0, config.campaign)

    def yaw(twin):
        T = simulate(twin, swing, lab.T_lab_base).poses["base_footprint"]
        return np.ptp(np.arctan2(T[:, 1, 0], T[:, 0, 0]))

    def stiffen(model):
        for wheel in lab.robot.wheels:
            for a in "xy":
                model.jnt_stiffness[model.joint(f"{wheel.name}.{a}").id] = 2e5
            model.geom(wheel.contact_geom).friction[0] = 5.0

    assert yaw(lab.twin) > 5e-3
    assert yaw(with_model(lab.twin, stiffen)) < 0.2 * yaw(lab.twin)


def test_the_same_trial_gives_the_same_bits(lab, sweep, states):
    again = simulate(lab.twin, sweep, lab.T_lab_base)
    np.testing.assert_array_equal(again.wrench, states.wrench)
    np.testing.assert_array_equal(again.motor, states.motor)


def test_the_plate_carries_the_weight_downwards(lab, states):
    mass = lab.twin.model.body_mass.sum()
    still = states.t < 1.0
    np.testing.assert_allclose(states.wrench[still, 2].mean(), -9.81 * mass, rtol=1e-4)
    np.testing.assert_allclose(states.wrench[still, :2].mean(axis=0), 0.0, atol=0.1)


def test_the_centre_of_pressure_is_under_the_centre_of_mass(lab, states):
    model, data = lab.twin.model, mujoco.MjData(lab.twin.model)
    T = states.poses["base_footprint"][0]
    data.joint("root").qpos[:3] = T[:3, 3]
    data.joint("root").qpos[3:] = [np.cos(-0.8), 0.0, 0.0, np.sin(-0.8)]
    for i, joint in enumerate(JOINTS):
        data.joint(joint).qpos = states.link[0, i]
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    com = data.subtree_com[model.body("base_footprint").id]
    centre = data.site("plate").xpos
    Fx, Fy, Fz, Mx, My, _ = states.wrench[:500].mean(axis=0)
    np.testing.assert_allclose([centre[0] - My / Fz, centre[1] + Mx / Fz], com[:2], atol=2e-3)


def test_a_motion_from_rest_to_rest_has_no_net_impulse(lab, config):
    path = CALIBRATION_SWINGS["around_y"]
    swing = motion.swing("y", "calibration", "swing", path, 3.0, config.campaign)
    states = simulate(lab.twin, swing, lab.T_lab_base)
    weight = 9.81 * lab.twin.model.body_mass.sum()
    assert np.ptp(states.wrench[:, 2]) > 10.0
    assert abs((states.wrench[:, 2] + weight).sum() * lab.twin.model.opt.timestep) < 0.2  # [N.s], 74 kg at 3 mm/s


def test_the_plate_sees_a_push_at_the_hand(lab, config):
    push = motion.pushed("push", "validation", 20.0, config.campaign)
    states = simulate(lab.twin, push, lab.T_lab_base)
    rest = config.campaign.rest
    before = states.wrench[(states.t > 0.5) & (states.t < rest - 0.1), :3].mean(axis=0)
    for k in range(3):
        held = (states.t > rest + 4.0 * k + 1.2) & (states.t < rest + 4.0 * k + 1.9)
        change = states.wrench[held, :3].mean(axis=0) - before
        assert np.linalg.norm(change) == pytest.approx(20.0, abs=1.0)


def test_a_payload_weighs_what_its_trial_says(lab, config, nominal):
    from twin.motions import schedule

    campaign = replace(config.campaign, payloads=(0.0, 2.0), calibration_payloads=(1.0,))
    trials = {m.id: m for m in schedule(campaign, nominal, 0) if m.name in ("xyz", "around_z")}
    masses = {name: lab.twin_in(m, 0.0).model.body_mass.sum() for name, m in trials.items()}
    assert masses["xyz_0kg"] == pytest.approx(masses["xyz"] - 0.437)
    assert masses["xyz_2kg"] == pytest.approx(masses["xyz"] + 2.0 - 0.437)
    assert masses["around_z_1kg"] == pytest.approx(masses["around_z"] + 1.0 - 0.437)
    assert trials["around_z_1kg"].role == "calibration" and trials["xyz_2kg"].role == "validation"


FIRST = """
import sys
from threading import Barrier, Thread
from twin.simulation.rollout import log_warnings
sys.setswitchinterval(1e-9)
together = Barrier(8)
threads = [Thread(target=lambda: (together.wait(), log_warnings())) for _ in range(8)]
for thread in threads:
    thread.start()
"""


def test_trials_that_begin_at_once_do_not_wait_for_each_other():
    """Without a lock two of three such processes hang: MuJoCo's first call runs Python while others wait for it."""
    begun = [subprocess.Popen([sys.executable, "-c", FIRST]) for _ in range(5)]
    try:
        assert [process.wait(timeout=60) for process in begun] == [0] * 5
    finally:
        for process in begun:
            process.kill()
