"""Nuisances of a design: their effect on the hand, the pull on a fit that does not ask for them, the rules' updates."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest

import mjcf
from calibration.design.exchange import _RULES, _Steps
from calibration.design.information import departing, departures_of, prospect
from calibration.numerics.lie import log6
from calibration.robot.blocks import Placements
from calibration.robot.chain import chain_of
from calibration.robot.hand import nominal_hand
from calibration.stages.geometry.parameters import geometry_parameters, reading_sigma
from scenarios import load
from twin.campaign import describe_dataset


@pytest.fixture(scope="module")
def robot():
    described = describe_dataset(load("humanoids2024").twin, ())
    chain = chain_of(mjcf.urdf(), described)
    parameters, play = geometry_parameters(chain, described), reading_sigma(chain, described)
    limits = (np.clip(x, -2.0, 2.0) for x in chain.limits)
    q = np.random.default_rng(0).uniform(*limits, size=(40, len(chain.measured)))
    hand = nominal_hand(chain, parameters.nominal[:12])
    return SimpleNamespace(chain=chain, hand=hand, q=q, fitted=(hand, parameters, described, np.maximum(play, 1e-4)))


def test_moments_are_those_of_inverse_dynamics_across_the_axis(robot):
    chain, q = robot.chain, robot.q[:5]
    model, found = chain.nominal, chain.carrying(0.0).gravity_moments(q)
    data = model.createData()
    for posture, of_posture in zip(chain.configurations(q), found, strict=True):
        pin.rnea(model, data, posture, np.zeros(model.nv), np.zeros(model.nv))
        for name, M in zip(chain.joints, of_posture, strict=True):
            i = model.getJointId(name)
            axis = chain.nominal_path.axis[chain.joints.index(name)] * (not chain.is_prismatic(name))
            force = data.f[i].angular
            R = model.jointPlacements[i].rotation.T @ data.liMi[i].rotation
            np.testing.assert_allclose(M, R @ (force - axis * (axis @ force)), atol=1e-9)


@pytest.fixture(scope="module")
def departures(robot):
    return departures_of(robot.chain, robot.q)


@pytest.mark.parametrize("z", range(8))
def test_a_nuisance_moves_the_hand_as_the_robot_would(robot, departures, z):
    hand, q, step = robot.hand, robot.q[:6], 1e-3
    G = departures.effects(hand, q)[:, :, z]
    M, T0 = robot.chain.gravity_moments(q), hand.poses(q)
    for k in range(len(q)):
        xi = np.zeros((8, 6))
        xi[z, 3:] = step * departures.bending[z] * M[k, z]
        T1 = hand.with_theta(xi.ravel(), hand.block(Placements).names).poses(q[k : k + 1])
        moved = log6(np.linalg.inv(T0[k : k + 1]) @ T1)[0] / step
        np.testing.assert_allclose(G[k], moved, atol=1e-6)


@pytest.fixture(scope="module")
def reported(robot, departures):
    hand, parameters, described, play = robot.fitted
    noise = prospect(hand, parameters, described, play, robot.q[:30], robot.q[30:])
    return departing(noise, hand, described, play, departures, robot.q[30:])


def test_the_pull_is_that_of_the_fit(reported):
    """Ridge regression of data that hold one nuisance and no noise leaves the hand off by P C m z - Z z."""
    chosen, z = np.arange(25), np.random.default_rng(1).normal(size=8)
    B, y = reported.B[chosen].reshape(150, -1), reported.H[chosen].reshape(150, -1) @ z
    x = np.linalg.lstsq(np.vstack([B, np.eye(B.shape[1])]), np.append(y, np.zeros(B.shape[1])), rcond=None)[0]
    C, m = reported.after(chosen), reported.pulled(chosen)
    np.testing.assert_allclose(reported.P @ x, reported.P @ (C @ m @ z), atol=1e-10)
    squared = reported.hand(C, m) ** 2 - reported.hand(C) ** 2
    each = np.stack([reported.P @ (C @ m[:, k]) - reported.Z[:, :, k] for k in range(8)])
    np.testing.assert_allclose(squared, (each**2).sum(axis=(0, 2)), rtol=1e-9)


@pytest.mark.parametrize("criterion", ["D", "G"])
def test_each_candidate_is_worth_what_the_criterion_says_with_it(reported, criterion):
    rule, taken = _RULES[criterion], np.arange(12)
    C, m = reported.after(taken), reported.pulled(taken)
    BC = reported.B @ C
    K = BC @ np.swapaxes(reported.B, 1, 2) + np.eye(6)
    inverse = np.linalg.inv(np.linalg.cholesky(K))
    values = rule.values(reported, _Steps(C, m, K, inverse @ BC, inverse @ (reported.H - BC @ m)))
    sets = [np.append(taken, k) for k in range(30)]
    direct = np.array([rule.value(reported, reported.after(some), reported.pulled(some)) for some in sets])
    if criterion == "D":
        np.testing.assert_allclose(values - values[0], direct - direct[0], atol=1e-8)
    else:
        np.testing.assert_allclose((values / values[0]) ** (1.0 / 16.0), direct / direct[0], rtol=1e-8)
    assert np.argsort(values[12:])[0] == np.argsort(direct[12:])[0]
