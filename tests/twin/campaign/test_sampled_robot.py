"""What `widths.spread` samples of a robot."""

from dataclasses import asdict

import numpy as np
import pytest

from scenarios import load
from twin.campaign import sample
from twin.config.robot import ArmJoint

GEAR = {"gap", "offset", "stiffness", "coulomb", "viscous"}
SEED = 3


def robot(*overrides):
    found = sample(load("humanoids2024", overrides).twin, SEED)
    return {d.joint_name: asdict(d) for d in found.defects if isinstance(d, ArmJoint)}, found.wheels


@pytest.mark.parametrize(("width", "sampled"), [("spread", GEAR), ("gaps_and_offsets", {"gap", "offset"})])
def test_a_spread_scatters_gears_within_its_bounds(width, sampled):
    (plain, wheels), (found, other) = robot(), robot(f"twin.widths.{width}=0.5")
    factors = [found[joint][what] / plain[joint][what] for joint in plain for what in sampled]
    same = [
        found[joint][what] == value for joint in plain for what, value in plain[joint].items() if what not in sampled
    ]
    assert all(same) and len(set(factors)) == len(factors)
    assert 0.5 <= min(factors) < 0.7 and 1.3 < max(factors) <= 1.5
    assert (wheels == other) == (width != "spread")


def test_a_spread_scatters_each_type_of_wheel():
    (_, plain), (_, found) = robot(), robot("twin.widths.spread=0.5")
    k = np.array([np.divide(b.bushing.stiffness, a.bushing.stiffness) for a, b in zip(plain, found, strict=True)])
    mu = np.array([b.footing.friction / a.footing.friction for a, b in zip(plain, found, strict=True)])
    factors = np.column_stack([k, mu])
    np.testing.assert_allclose(k[:, 0], k[:, 1])  # a bushing that is round stays so
    kinds = np.unique(factors.round(9), axis=0)
    assert len(kinds) == 3 and len(np.unique(kinds[:, [0, 2, 3]])) == 9
    assert (abs(factors - 1.0) <= 0.5).all() and abs(factors - 1.0).max() > 0.2
    for right, left in zip(found[::2], found[1::2], strict=True):
        assert right.bushing == left.bushing and right.footing == left.footing
