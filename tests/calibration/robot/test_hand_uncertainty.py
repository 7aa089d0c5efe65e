"""The band of predicted markers against its definition and against drawn errors."""

import numpy as np
import pytest

from calibration.numerics.lie import exp6, inverse
from calibration.robot.hand import nominal_hand
from calibration.robot.hand_uncertainty import Predicted, Session, Spread, predicted_points, radius_95
from tests.doubles import rigid_robot

X = np.array(rigid_robot.BODIES["gripper"][1])
NONE = Spread((), np.zeros((0, 0)), np.zeros(8), np.zeros(2))


@pytest.fixture(scope="module")
def hand(chain):
    return nominal_hand(chain, np.r_[0.1, -0.2, 0.3, 0.02, 0.01, -0.5, 0.02, 0.0, 0.05, 0.1, 0.2, -0.1])


def test_another_day_moves_base_and_marker_body_as_it_says(hand):
    q = rigid_robot.near_postures(np.random.default_rng(0), 1)
    session, rng = Session((1e-3, 2e-3), (5e-4, 5e-3)), np.random.default_rng(1)
    found = predicted_points(hand, NONE, X, q, session)
    x = rng.normal(size=(20000, 12)) * np.sqrt(session.variances)
    T = inverse(exp6(x[:, :6])) @ hand.poses(q) @ exp6(x[:, 6:])
    p = np.einsum("nij,mj->nmi", T[:, :3, :3], X) + T[:, None, :3, 3]
    for k in range(len(X)):
        np.testing.assert_allclose(found.covariance[0, k], np.cov(p[:, k].T), atol=0.06 * np.trace(np.cov(p[:, k].T)))
    e = np.linalg.norm(p - found.positions, axis=2)
    assert (e <= found.radius_95).mean() == pytest.approx(0.95, abs=0.01)


def test_random_errors_of_readings_go_along_lever_arms(hand):
    q = rigid_robot.near_postures(np.random.default_rng(0), 1)
    reading = np.array([0.0, 1.0, 1.0, 1.5, 1.5, 3.0, 12.0, 10.0]) * 1e-3
    found = predicted_points(hand, Spread(NONE.names, NONE.theta, reading, np.array([1e-4, 0.0])), X, q)
    T = hand.poses(q + reading * np.random.default_rng(2).normal(size=(20000, 8)))
    p = np.einsum("nij,mj->nmi", T[:, :3, :3], X) + T[:, None, :3, 3]
    expected = np.cov(p[:, 0].T) + 1e-8 * np.eye(3)
    np.testing.assert_allclose(found.covariance[0, 0], expected, atol=0.05 * np.trace(expected))


def test_a_hand_that_was_seen_as_a_point_has_random_errors_of_its_place_only():
    seen = Spread(NONE.names, NONE.theta, np.full(2, 1e-3), np.array([2e-3]))
    np.testing.assert_array_equal(seen.random_errors(np.zeros((1, 6, 2))), [np.diag([4e-6] * 3 + [0.0] * 3)])


def test_the_radius_of_a_sphere_is_that_of_chi_with_three_degrees():
    found = Predicted(np.zeros((1, 1, 3)), np.eye(3)[None, None])
    assert found.radius_95[0, 0] == pytest.approx(np.sqrt(7.815), rel=1e-3)


@pytest.mark.parametrize("far", [0.0, 1.0, 5.0])
def test_a_place_that_is_known_to_be_off_is_no_random_error(far):
    rng, offset = np.random.default_rng(3), far * np.array([2.0, -1.0, 0.5])
    A = rng.normal(size=(3, 3))
    radius = radius_95((A @ A.T)[None], offset[None])[0]
    e = np.linalg.norm(rng.normal(size=(100000, 3)) @ A.T + offset, axis=1)
    assert (e <= radius).mean() == pytest.approx(0.95, abs=0.012)
    assert radius <= radius_95((A @ A.T + np.outer(offset, offset))[None])[0]
