"""Every parameter block and every residual: derivatives against finite differences, values where documented."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.inference.map_estimate import Problem
from calibration.inference.parameters import ParameterSet
from calibration.numerics.lie import inverse, log6
from calibration.robot.hand import HandModel
from calibration.stages.geometry.hand_residual import HandResidual, NoiseModel
from calibration.stages.geometry.parameters import FULL, hand_model
from tests.doubles import rigid_robot

STEP = 1e-6
NONE = NoiseModel(np.zeros(0), np.zeros(0), np.zeros(0))


@pytest.fixture(scope="module")
def hand(chain) -> HandModel:
    """A robot with every parameter away from zero."""
    nominal, rng = hand_model(chain, np.zeros(12)), np.random.default_rng(0)
    return nominal.with_theta(0.05 * rng.normal(size=len(nominal.theta)))


def derivative(value, theta):
    """Central differences of value(theta) along a last axis."""
    steps = STEP * np.eye(len(theta))
    return np.stack([(value(theta + d) - value(theta - d)) / (2.0 * STEP) for d in steps], axis=-1)


@pytest.mark.parametrize("kind", FULL, ids=lambda kind: kind.__name__)
def test_a_block_s_jacobian_is_its_derivative(hand, kind):
    q, names = rigid_robot.random_angles(np.random.default_rng(1), 3), hand.block(kind).names
    found = hand.poses_and_derivatives(q, names=names)
    numeric = derivative(lambda x: log6(inverse(found.T) @ hand.with_theta(x, names).poses(q)), hand.block(kind).values)
    np.testing.assert_allclose(found.J, numeric, atol=2e-8)
    assert len(names) == len(hand.block(kind).units) == len(hand.block(kind).groups) == found.J.shape[2]


@pytest.mark.parametrize("kind", FULL, ids=lambda kind: kind.__name__)
def test_a_block_adds_to_the_readings_what_it_says(hand, kind):
    q = rigid_robot.random_angles(np.random.default_rng(2), 4)
    block, tau = hand.block(kind), hand.nominal.gravity_torques(q)
    without = replace(hand, blocks=tuple(b for b in hand.blocks if b is not block))
    error = block.reading_error(q[:, hand.nominal.columns], tau)
    np.testing.assert_allclose((without.angles(q) - hand.angles(q))[:, hand.nominal.columns], error + 0.0 * tau)


def residuals(hand, point):
    """Hand poses, or a point of the hand, of a robot with other parameters."""
    rng = np.random.default_rng(3)
    postures = rigid_robot.postures(rigid_robot.defects(3), rigid_robot.random_angles(rng, 4), 1e-4)
    if point:
        postures = replace(postures, covariance=postures.covariance[:, :3, :3], point=np.array([0.01, 0.02, 0.03]))
    names = hand.names if point else hand.names[:20]
    return HandResidual(hand, names, postures, NONE)


@pytest.mark.parametrize("point", [False, True], ids=["pose", "point"])
def test_a_residual_s_jacobian_is_its_derivative(hand, point):
    residual = residuals(hand, point)
    theta = hand.theta[[hand.names.index(name) for name in residual.names]]
    numeric = derivative(lambda x: residual.linearise(x).r, theta)
    np.testing.assert_allclose(residual.linearise(theta).J, numeric, atol=2e-7)


def test_stacked_residuals_cost_what_they_cost_one_by_one(hand):
    parts = residuals(hand, False), residuals(hand, True)
    p = len(hand.names)
    parameters = ParameterSet(hand.names, ("m",) * p, np.zeros(p), np.full(p, np.inf))
    together, noise = Problem(parts, parameters).linearise(hand.theta), Problem(parts, parameters).noise
    assert noise.names == ("markers", "padding") and together.r.shape == (8, 6)
    white = noise.whitener(together, noise.start)
    r, J = (white @ together.r[..., None])[..., 0], white @ together.J
    for rows, part in zip((slice(0, 4), slice(4, 8)), parts, strict=True):
        columns = [hand.names.index(name) for name in part.names]
        alone = part.linearise(hand.theta[columns])
        W = part.noise.whitener(alone, part.noise.start)
        np.testing.assert_allclose((r[rows] ** 2).sum(), ((W @ alone.r[..., None]) ** 2).sum())
        H, G = np.zeros((p, p)), (W @ alone.J).reshape(-1, len(columns))
        H[np.ix_(columns, columns)] = G.T @ G
        mine = J[rows].reshape(-1, p)
        np.testing.assert_allclose(mine.T @ mine, H, atol=1e-9 * np.abs(H).max())
