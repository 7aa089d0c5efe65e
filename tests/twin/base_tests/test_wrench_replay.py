"""A base without the robot follows a wrench as its springs and its friction say."""

from dataclasses import replace

import numpy as np
import pytest

from twin.base_tests import WrenchHistory, massless_base, replay
from twin.defects.wheels import spatial_stiffness, wheels_of

T = np.arange(0.0, 6.0, 0.01)
STANDING = np.array([0.0, 0.0, -730.0, 0.0, 0.0, 0.0])


def pull(change, profile):
    """A wrench that stands still for a second, then changes as the profile (n,) says."""
    return WrenchHistory(T, STANDING + np.outer(profile, change))


def hump(start=1.0, stop=3.0, ramp=0.5):
    return np.clip(np.minimum((T - start) / ramp, (stop - T) / ramp), 0.0, 1.0)


@pytest.mark.parametrize("wheels", ["anchored", "contact"])
def test_a_steady_load_moves_the_base_by_its_compliance(config, wheels):
    base = replace(config.base, wheels=wheels)
    change = np.array([2.0, -1.0, 0.0, 5.0, 4.0, 0.3])
    x = replay(massless_base(base), pull(change, hump(stop=9.0)))
    K, _ = spatial_stiffness(wheels_of(base))
    expected = np.linalg.solve(K + preload(base), change)
    np.testing.assert_allclose(x[-1], expected, rtol=0.03, atol=3e-3 * np.abs(expected).max())


def preload(base):
    """Tangent of the wheels' loads, which turn with the base: -f x theta."""
    G = np.zeros((6, 6))
    G[0, 4], G[1, 3] = -730.0, 730.0
    return G


def test_what_friction_holds_comes_back_and_what_it_does_not_stays(config):
    twin = massless_base(config.base)
    held = replay(twin, pull(np.array([0, 0, 0, 0, 0, 0.5]), hump()))
    assert np.abs(held[-1]).max() < 0.02 * np.abs(held).max()
    slipped = replay(twin, pull(np.array([0, 0, 0, 0, 0, 20.0]), hump()))
    assert abs(slipped[-1, 5]) > 1e-3


def test_nothing_moves_before_the_wrench_changes(config):
    x = replay(massless_base(config.base), pull(np.array([5.0, 0, 0, 0, 0, 0]), hump()))
    assert np.abs(x[T < 0.95]).max() < 1e-5


def test_the_weight_stays_under_a_base_that_slides_round(config):
    """By 20 mrad or more: at 1 m from the origin it would go 2 cm with that, and tilt the base by a milliradian."""
    x = replay(massless_base(config.base), pull(np.array([0, 0, 0, 0, 0, 32.0]), hump()))
    assert np.abs(x[:, 5]).max() > 0.02
    assert np.abs(x[:, 3:5]).max() < 1e-4


def test_a_replay_repeats_bit_for_bit(config):
    twin, load = massless_base(config.base), pull(np.array([0, 9.0, 0, 8.0, 0, 9.0]), hump())
    np.testing.assert_array_equal(replay(twin, load), replay(twin, load))


@pytest.mark.parametrize("weight", [400.0, 730.0])
def test_casters_that_turn_hold_the_same_force_under_any_load(config, weight):
    """4 f along x, all four being alike; the drives slide freely."""
    force, caster = 8.0, replace(config.base.caster_front, friction=2.0, turning_force=8.0)
    drive = replace(config.base.drive, friction=0.0)
    base = replace(config.base, drive=drive, caster_front=caster, caster_back=caster)
    twin = massless_base(base, timestep=5e-4)  # at 1 ms so light a base flutters on drives without any friction
    standing, slow = np.array([0.0, 0.0, -weight, 0.0, 0.0, 0.0]), hump(start=1.0, stop=5.0, ramp=2.0)
    held, turned = (
        replay(twin, WrenchHistory(T, standing + np.outer(slow, [4.0 * force * share, 0, 0, 0, 0, 0])))
        for share in (0.9, 1.1)
    )
    assert abs(held[-1, 0]) < 0.02 * np.abs(held[:, 0]).max()
    assert turned[-1, 0] > 1e-3
