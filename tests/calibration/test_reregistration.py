from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from calibration.errors import NotEnoughData
from calibration.hand import nominal_hand
from calibration.parameters import nominal_frames
from calibration.reregistration import _fit
from calibration.robot import chain_of
from calibration.schema import Description


@pytest.fixture(scope="module")
def description(dataset):
    return dataset.description


@pytest.fixture(scope="module")
def hand(dataset, description: Description):
    chain = chain_of(dataset.urdf, description)
    return nominal_hand(chain, nominal_frames(chain, description))


def postures(n, n_joints, seed=1):
    return np.random.default_rng(seed).uniform(-0.6, 0.6, size=(n, n_joints)) + 0.2


def test_remounted_markers_are_found_where_they_are(hand, description):
    rng = np.random.default_rng(2)
    moved = replace(hand, base=hand.base + 3e-3 * rng.normal(size=6), hand=hand.hand + 8e-3 * rng.normal(size=6))
    q = postures(8, len(description.joints))
    found = _fit(hand, q, moved.poses(q), description)
    np.testing.assert_allclose(found.base, moved.base, atol=1e-9)
    np.testing.assert_allclose(found.hand, moved.hand, atol=1e-9)
    assert found.chain is hand.chain and found.offset is hand.offset


def test_what_is_left_is_smallest_in_units_of_the_tolerances(hand, description):
    """No small move of either frame makes the weighted misfit to noisy poses smaller."""
    rng, q = np.random.default_rng(3), postures(8, len(description.joints))
    noise = [pin.exp6(1e-3 * rng.normal(size=6)).homogeneous for _ in q]
    T = hand.poses(q) @ np.array(noise)
    tol = description.tolerances
    weight = 1.0 / np.repeat([tol.body_translation, tol.body_rotation], 3)

    def misfit(model):
        error = np.linalg.inv(T) @ model.poses(q)
        return sum(np.sum((weight * pin.log6(pin.SE3(E)).vector) ** 2) for E in error)

    best = _fit(hand, q, T, description)
    for k in range(12):
        step = 1e-4 * np.eye(12)[k]
        for sign in (1.0, -1.0):
            other = replace(best, base=best.base + sign * step[:6], hand=best.hand + sign * step[6:])
            assert misfit(other) > misfit(best)


def test_postures_that_cannot_tell_both_frames_are_refused(hand, description):
    q = postures(8, len(description.joints))
    with pytest.raises(NotEnoughData, match="0 registration postures"):
        _fit(hand, q[:0], np.empty((0, 4, 4)), description)
    turned = np.repeat(q[:1], 6, axis=0)
    turned[:, 1] += np.linspace(0.0, 0.5, 6)
    with pytest.raises(NotEnoughData, match="about one direction only"):
        _fit(hand, turned, hand.poses(turned), description)
