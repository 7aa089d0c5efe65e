"""A mesh stiffer than a time step can integrate is refused, where its simulation begins to gain energy."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.stats.qmc import Halton

import mjcf
from tests.doubles.gear_bench import LINK_INERTIA, OUTPUT_INERTIA, bench, gear
from twin.campaign import laboratory, sample
from twin.simulation import build
from twin.simulation.gear_limits import GearTooStiff, halton

STEP = 1e-3
MASS = 1.0 / (1.0 / (LINK_INERTIA + OUTPUT_INERTIA) + 1.0 / 50.0)


def with_arm(config, **changes):
    """The configuration with values of arm joints changed, and neither friction nor play anywhere in the arm."""
    slippery = {name: replace(j, coulomb=0.0, viscous=0.0, gap=0.0) for name, j in config.arm.items()}
    return replace(config, arm=slippery | {name: replace(slippery[name], **c) for name, c in changes.items()})


def kicked(config):
    """Greatest speed [rad/s] of the arm's links, 1 s after one was kicked by 1 rad/s, all joints at zero."""
    model = build(mjcf.spec(), sample(config, 0).defects, timestep=config.timestep).model
    data = mujoco.MjData(model)
    links = [model.joint(name).dofadr[0] for name in config.arm]
    mujoco.mj_step(model, data, nstep=200)
    data.qvel[model.joint("arm_3_joint").dofadr[0]] += 1.0
    mujoco.mj_step(model, data, nstep=1000)
    return np.abs(data.qvel[links]).max() if data.time > 1.19 else np.inf


def test_the_limit_in_contact_is_where_the_robot_rings(config):
    """Without friction that would hide it, in the posture in which the arm's third link is lightest."""
    with pytest.raises(
        GearTooStiff, match="mesh stiffness 30000 .*'arm_3_joint'.* use at most 18000 N.m/rad"
    ) as refused:
        laboratory(with_arm(config, arm_3_joint={"stiffness": 3e4}), 0)
    below, above = (with_arm(config, arm_3_joint={"stiffness": s * refused.value.most}) for s in (0.96, 1.04))
    assert kicked(below) < 0.5
    assert kicked(above) > 5.0
    laboratory(below, 0)


def restitution(kappa, delta):
    """Geometric mean of speed after over speed before a bounce, over where within a step it begins."""
    K, D, speed, ratios = kappa * MASS / STEP**2, delta * MASS / STEP, 1.0, []
    for part in (np.arange(16) + 0.5) / 16:
        gap = 0.02 + 2.0 * part * STEP * speed
        log = bench([gear(gap=gap, stiffness=K, damping=D)]).run(speed=speed, duration=0.035)
        ratios.append(abs(log.link_speed[-1, 0]) / speed)
    return float(np.exp(np.log(ratios).mean()))


@pytest.mark.parametrize("delta", [0.02, 0.1, 0.2])
def test_bounces_in_the_play_gain_speed_beyond_the_limit_alone(delta):
    assert restitution(2.0, delta) < 1.0
    assert restitution(2.9, delta) > 1.0


@pytest.mark.parametrize("form", ["dead_zone", "friction_held"])
@pytest.mark.parametrize("coupled", [False, True])
def test_the_limit_is_reported_as_the_scenario_gives_it(config, form, coupled):
    config = replace(config, gear_form=form, coupled_wrist=coupled)

    def of(**changes):
        return replace(config, arm=config.arm | {"arm_7_joint": replace(config.arm["arm_7_joint"], **changes)})

    with pytest.raises(GearTooStiff, match="arm_7_joint") as refused:
        laboratory(of(stiffness=2e4), 0)
    assert 8e3 < refused.value.most < 12e3
    laboratory(of(stiffness=0.99 * refused.value.most), 0)
    with pytest.raises(GearTooStiff, match="arm_7_joint"):
        laboratory(of(stiffness=1.01 * refused.value.most), 0)


def test_too_much_damping_is_reported_as_such(config):
    with pytest.raises(GearTooStiff, match="mesh damping 30 N.m.s/rad of 'arm_7_joint'.* use at most 10 N.m.s/rad"):
        laboratory(
            replace(config, arm=config.arm | {"arm_7_joint": replace(config.arm["arm_7_joint"], damping=30.0)}), 0
        )


def test_postures_are_spread_by_haltons_sequence():
    np.testing.assert_array_equal(halton(100, 7), Halton(7, scramble=False).random(100))
