"""Single gears on a bench, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from tests.doubles.gear_bench import LINK_INERTIA, OUTPUT_INERTIA, bench, gear
from twin.defects import GearFriction

GAP, K, J = 0.02, 1000.0, LINK_INERTIA + OUTPUT_INERTIA
SLIP, K_SLIP = 0.4, 500.0
HYSTERESIS = GearFriction("elbow", K_SLIP, SLIP, 0.0)


def wave(amplitude, period=4.0, turns=2):
    return amplitude * np.sin(2 * np.pi * np.arange(round(1000 * turns * period)) / 1000 / period)


def flanks(log, torque):
    """Slope [N.m/rad] and intercept [rad] of both loaded flanks, of the second turn."""
    late = log.t >= log.t[-1] / 2
    for sign in (1.0, -1.0):
        loaded = late & (sign * torque > 1.0)
        slope, intercept = np.polyfit(torque[loaded], log.twist[loaded, 0], 1)
        yield 1.0 / slope, intercept


def test_play_and_stiffness_of_a_dead_zone_are_those_written():
    torque = wave(3.0, period=8.0)
    for stiffness, intercept in flanks(bench([gear()]).run(torque), torque):
        assert stiffness == pytest.approx(K, rel=1e-2)
        assert 2.0 * abs(intercept) == pytest.approx(GAP, rel=1e-2)


def test_a_dead_zone_has_no_loop():
    """Held along a slow cycle, no torque inside the gap, K (|delta| - gap/2) outside, the same on the way back."""
    log = bench([gear()]).run(hold=wave(0.013, period=8.0))
    late = log.t > 8.0
    delta, torque = log.twist[late, 0], log.torque[late, 0]
    expected = K * np.sign(delta) * np.maximum(np.abs(delta) - GAP / 2, 0.0)
    np.testing.assert_allclose(torque, expected, atol=0.01 * expected.max())


def test_a_friction_held_mesh_has_the_loop_of_a_spring_and_a_slider():
    log = bench([gear(), HYSTERESIS]).run(hold=wave(0.013, period=8.0))
    late = log.t >= 8.0
    delta, torque = log.twist[late, 0], log.torque[late, 0]
    amplitude = np.ptp(delta) / 2.0
    area = np.trapezoid(torque, delta)
    assert area == pytest.approx(4.0 * SLIP * (amplitude - SLIP / K_SLIP), rel=1e-2)
    assert torque.max() == pytest.approx(K * (amplitude - GAP / 2) + SLIP, rel=1e-2)
    crossing = (np.abs(delta) < 0.4 * GAP) & (np.gradient(delta) > 0)
    np.testing.assert_allclose(torque[crossing], SLIP, rtol=1e-2)


def test_play_and_stiffness_of_a_friction_held_mesh_are_those_written():
    """Where the slider slips, a flank is a line of the mesh's stiffness from half the play on, SLIP above zero."""
    log = bench([gear(), HYSTERESIS]).run(hold=wave(0.013, period=8.0))
    late = log.t >= 8.0
    delta, torque, rate = log.twist[late, 0], log.torque[late, 0], np.gradient(log.twist[late, 0])
    starts = []
    for sign in (1.0, -1.0):
        loading = (sign * delta > 0.011) & (sign * rate > 0)
        stiffness, at_rest = np.polyfit(delta[loading], torque[loading], 1)
        assert stiffness == pytest.approx(K, rel=1e-2)
        starts.append((sign * SLIP - at_rest) / stiffness)
    assert starts[0] - starts[1] == pytest.approx(GAP, rel=1e-2)


def test_a_mesh_that_slips_is_stiffer_after_each_reversal():
    log = bench([gear(), HYSTERESIS]).run(hold=wave(0.013, period=8.0))
    late = log.t >= 8.0
    delta, torque, rate = log.twist[late, 0], log.torque[late, 0], np.gradient(log.twist[late, 0])
    loading = (delta > 0.011) & (rate > 0)
    top = delta.max()
    unloading = (delta < top - 1e-4) & (delta > top - 2 * SLIP / K_SLIP + 1e-4) & (rate < 0)
    assert np.polyfit(delta[loading], torque[loading], 1)[0] == pytest.approx(K, rel=1e-2)
    assert np.polyfit(delta[unloading], torque[unloading], 1)[0] == pytest.approx(K + K_SLIP, rel=1e-2)


def test_a_blow_on_a_flank_is_that_of_a_spring_and_a_damper():
    """A link flies against the flank of a motor that stands: rebound and peak torque of a damped half wave."""
    speed, zeta = 0.5, 1.0 / (2.0 * np.sqrt(K * J))
    log = bench([gear()]).run(speed=speed, duration=0.12)
    damped = np.sqrt(1.0 - zeta**2)
    touched = np.flatnonzero(np.abs(log.twist[:, 0]) > GAP / 2)
    left = touched[np.flatnonzero(np.diff(touched, append=touched[-1] + 9) > 1)[0]] + 2
    rebound = np.exp(-zeta * (np.pi - 2.0 * np.arcsin(zeta)) / damped)  # contact ends where the torque does
    assert -log.link_speed[left, 0] / speed == pytest.approx(rebound, rel=0.02)
    assert np.abs(log.link_speed).max() <= speed * 1.001
    assert np.abs(log.torque).max() < 1.03 * speed * np.sqrt(K * J)


@pytest.mark.parametrize("extra", [(), (GearFriction("elbow", K_SLIP, SLIP, 0.3),)], ids=["dead_zone", "friction_held"])
def test_a_reversing_motor_makes_no_spike(extra):
    """Moved by motor against friction, neither speed nor torque of the link exceeds what an elastic blow can do."""
    train = replace(gear(), rotor_inertia=0.15, servo_stiffness=2500.0, servo_damping=23.0, coulomb=0.15, viscous=0.05)
    command = wave(0.5, period=4.0)
    log = bench([train, *extra]).run(command=command)
    fastest = np.abs(np.diff(command)).max() * 1000.0
    k = K + (K_SLIP if extra else 0.0)
    assert np.abs(log.link_speed).max() <= 2.0 * fastest
    accelerating = np.abs(log.torque).max()
    assert accelerating < fastest * np.sqrt(k * J) + 0.15 + (0.3 + SLIP if extra else 0.0) + 0.05 * fastest


def crossings(log):
    """How often the link changes flank after the start."""
    loaded = (np.abs(log.twist[:, 0]) > 0.45 * GAP) & (log.t > 0.5)
    return np.count_nonzero(np.diff(np.sign(log.twist[loaded, 0])))


def test_load_decides_the_flank_of_a_dead_zone_and_motion_that_of_held_play():
    """A motor goes back and forth twice under a load that never changes its sign."""
    train = replace(gear(), rotor_inertia=0.15, servo_stiffness=2500.0, servo_damping=23.0, coulomb=0.15, viscous=0.05)
    command, load = wave(0.3), np.full(8000, 0.5)

    def driven(extra):
        return bench([train, *extra]).run(command=command, torque=load)

    dead_zone, held = driven([]), driven([GearFriction("elbow", K_SLIP, 0.0, 1.0)])
    settled = dead_zone.t > 0.5
    assert np.all(dead_zone.twist[settled, 0] > 0.45 * GAP)
    assert crossings(held) == 4
    fastest = 0.3 * 2 * np.pi / 4.0  # rising at 4 s, falling at 6 s, long after each reversal
    windup = 2 * (1.15 + 0.05 * fastest) / K  # friction of the link; the load moves both flanks alike
    assert abs(held.twist[6000, 0] - held.twist[4000, 0]) == pytest.approx(GAP + windup, rel=0.01)


def test_held_play_does_not_creep():
    held = bench([replace(gear(), coulomb=0.15), GearFriction("elbow", K_SLIP, 0.2, 1.0)])
    angle = held.run(torque=np.full(20000, 1.0)).link[:, 0]
    assert angle[-1] - angle[1000] < 1e-6  # [rad] in 19 s


def energy(log, k_slip):
    """Kinetic and elastic energy (n,) [J]."""
    delta = log.twist[:, 0]
    kinetic = 0.5 * J * log.link_speed[:, 0] ** 2 + 0.5 * 0.15 * log.motor_speed[:, 0] ** 2
    elastic = 0.5 * K * np.maximum(np.abs(delta) - GAP / 2, 0.0) ** 2
    return kinetic + elastic + 0.5 * k_slip * (delta - log.plastic.sum(axis=1) / 2.0) ** 2


def dissipated(log, k_slip):
    """Work (n,) [J] done on the mesh's damper while it pushes, and on the slider."""
    delta, rate = log.twist[:, 0], (log.link_speed - log.motor_speed)[:, 0]
    depth = np.maximum(np.abs(delta) - GAP / 2, 0.0)
    push = np.where(depth > 0.0, np.maximum(K * depth + np.sign(delta) * rate, 0.0) - K * depth, 0.0)
    work = push * np.sign(delta) * rate
    slip = np.diff(log.plastic.sum(axis=1) / 2.0, append=0.0)
    slip[-1] = 0.0
    return np.cumsum(work * log.t[1] + k_slip * (delta - log.plastic.sum(axis=1) / 2.0) * slip)


@pytest.mark.parametrize("k_slip", [0.0, K_SLIP], ids=["dead_zone", "friction_held"])
def test_energy_never_grows_when_nobody_adds_any(k_slip):
    train = replace(gear(), rotor_inertia=0.15, servo_stiffness=1e-12, servo_damping=0.0)
    log = bench([train, *([HYSTERESIS] if k_slip else [])]).run(speed=1.0, duration=0.6)
    E = energy(log, k_slip)
    assert E[-1] < 0.5 * E[0]
    assert (E - np.minimum.accumulate(E)).max() < 0.01 * E[0]  # before a force acts: 1/2 K (v dt)^2 = 0.02 E[0]
    assert E[-1] + dissipated(log, k_slip)[-1] == pytest.approx(E[0], rel=0.05)
