"""Two joints on one differential, on a bench."""

from dataclasses import replace

import numpy as np
import pytest

from tests.doubles.gear_bench import bench, gear
from twin.campaign import laboratory
from twin.defects import GearFriction
from twin.defects.differential import Differential, UnlikeMotors
from twin.defects.gear import mesh_tendon
from twin.motions import JOINTS

NAMES = ("pitch", "roll")
GAPS, K = (0.024, 0.020), (1000.0, 1400.0)
PAIR = Differential(tuple(gear(n, gap=g, stiffness=k, damping=5.0) for n, g, k in zip(NAMES, GAPS, K, strict=True)))


def triangle(n=8000):
    return np.interp(np.arange(n), [0, n // 4, 3 * n // 4, n], [0.0, 1.0, -1.0, 0.0])


def test_each_motor_moves_both_joints():
    """A turn of motor 1 alone is half a turn of both joints, that of motor 2 the same, in opposite senses."""
    tight = Differential(tuple(replace(g, gap=0.0, servo_damping=3e3, rotor_inertia=0.5) for g in PAIR.gears))
    for sign in (1.0, -1.0):
        motor = 0.4 * triangle()
        log = bench([tight], NAMES).run(command=np.stack([motor / 2, sign * motor / 2], axis=1))
        m = log.motor @ np.array([[1.0, 1.0], [1.0, -1.0]])
        still, moving = (1, 0) if sign > 0 else (0, 1)
        assert np.ptp(m[:, moving]) > 0.7 and np.ptp(m[:, still]) < 1e-3
        np.testing.assert_allclose(log.link[:, 0], m[:, moving] / 2, atol=2e-3)
        np.testing.assert_allclose(log.link[:, 1], sign * m[:, moving] / 2, atol=2e-3)


def test_the_play_of_one_motor_shows_on_both_joints():
    """Only motor 1 has play: a torque on one joint lets both turn, by a quarter of the gap to each side."""
    one = Differential((PAIR.gears[0], replace(PAIR.gears[1], gap=0.0)))
    torque = 2.0 * triangle()
    log = bench([one], NAMES).run(torque=np.stack([torque, np.zeros_like(torque)], axis=1))
    stiff = 0.5 * (1.0 / K[0] - 1.0 / K[1])
    for flank in (1.0, -1.0):
        loaded = flank * torque > 1.0
        slope, intercept = np.polyfit(torque[loaded], log.twist[loaded, 1], 1)
        assert intercept == pytest.approx(flank * GAPS[0] / 4, rel=0.02)
        assert slope == pytest.approx(stiff, rel=0.05)


def test_play_and_compliance_of_a_joint_are_the_truths():
    truth = {p.name: p.value for p in PAIR.parameters()}
    for column, name in enumerate(NAMES):
        torque = np.zeros((8000, 2))
        torque[:, column] = 2.0 * triangle()
        log = bench([PAIR], NAMES).run(torque=torque)
        ends = []
        for flank in (1.0, -1.0):
            loaded = flank * torque[:, column] > 1.0
            slope, intercept = np.polyfit(torque[loaded, column], log.twist[loaded, column], 1)
            assert slope == pytest.approx(truth[f"gear.{name}.compliance"], rel=0.01)
            ends.append(intercept)
        assert ends[0] - ends[1] == pytest.approx(truth[f"backlash.{name}.gap"], rel=0.01)


@pytest.mark.parametrize(
    "frictions",
    [
        (GearFriction("pitch", 500.0, 1.2, 0.0), GearFriction("roll", 800.0, 0.4, 0.0)),
        pytest.param((GearFriction("roll", 500.0, 0.8, 0.0),), marks=pytest.mark.slow),
    ],
)
def test_friction_of_a_joint_is_the_truths(frictions):
    """A flank's lines to and fro are twice the slip apart, and begin to part with the slope of mesh and slider."""
    pair = Differential(tuple(replace(g, damping=0.5) for g in PAIR.gears), frictions)
    truth = {p.name: p.value for p in pair.parameters()}
    for column, name in enumerate(NAMES):
        torque = np.zeros((20000, 2))
        torque[:, column] = 16.0 * np.interp(np.arange(20000), [0, 8000, 16000, 20000], [0.0, 1.0, 0.0, 0.0])
        log = bench([pair], NAMES).run(torque=torque)
        load, twist, t = torque[:, column], log.twist[:, column], np.arange(20000)
        up, down = (t < 8000) & (load > 10.0), (t > 8000) & (t < 16000) & (load > 3.0) & (load < 8.0)
        (k_up, at_up), (k_down, at_down) = (np.polyfit(twist[w], load[w], 1) for w in (up, down))
        middle = twist[down].mean()
        slip = 0.5 * (k_up * middle + at_up - k_down * middle - at_down)
        assert slip == pytest.approx(truth[f"hysteresis.{name}.slip"], rel=0.02)
        back = (t > 8020) & (load > 14.5)
        stiffness = np.polyfit(twist[back], load[back], 1)[0] - 1.0 / truth[f"gear.{name}.compliance"]
        assert stiffness == pytest.approx(truth[f"hysteresis.{name}.stiffness"], rel=0.02)


def test_unlike_motors_are_refused():
    with pytest.raises(UnlikeMotors, match="pitch and roll .*rotor inertia are 50 and 40"):
        Differential((PAIR.gears[0], replace(PAIR.gears[1], rotor_inertia=40.0)))


def test_the_robots_wrist_can_be_a_differential(config):
    lab = laboratory(replace(config, coupled_wrist=True, gear_form="friction_held"), 0)
    model = lab.twin.model
    wraps = {}
    for name in JOINTS[1:]:
        tendon = model.tendon(mesh_tendon(name))
        adr, n = model.tendon_adr[tendon.id], model.tendon_num[tendon.id]
        wraps[name] = [
            (model.joint(i).name, c)
            for i, c in zip(model.wrap_objid[adr : adr + n], model.wrap_prm[adr : adr + n], strict=True)
        ]
    assert len(wraps["arm_5_joint"]) == 2
    assert dict(wraps["arm_7_joint"]) == {
        "arm_6_joint": 1.0,
        "arm_7_joint": -1.0,
        "arm_6_joint.motor": -1.0,
        "arm_7_joint.motor": 1.0,
    }
    truth = {p.name: p.value for p in lab.twin.truth}
    assert truth["backlash.arm_6_joint.gap"] == pytest.approx(0.022)
    assert truth["hysteresis.arm_6_joint.slip"] == pytest.approx(0.4)
    assert truth["hysteresis.arm_7_joint.holding"] == pytest.approx(1.0)
    assert truth["differential.motor_1.slip"] == pytest.approx(0.2)
