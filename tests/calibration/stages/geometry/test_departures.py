"""Directions in which robots depart from a rigid chain."""

from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration.numerics.lie import adjoint, from_vector, inverse, jlog6, log6
from calibration.robot.chain import chain_of
from calibration.robot.hand import nominal_hand
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.geometry.departures import NAMES, TakenForKnown, departures, with_gears
from calibration.stages.geometry.hand_residual import fit
from calibration.stages.geometry.parameters import geometry_parameters
from tests.doubles import rigid_robot


def test_a_column_bends_where_it_slid_to():
    description, rng = rigid_robot.described(), np.random.default_rng(0)
    chain = chain_of(mjcf.urdf(), description)
    hand = nominal_hand(chain, nominal_frames(chain, description))
    postures = rigid_robot.postures(rigid_robot.defects(0), rigid_robot.random_angles(rng, 10))
    found = departures(hand, postures, 1e-2)
    T, column = hand.in_base_frame(postures.q), chain.poses(hand.angles(postures.q), chain.joints[0])
    M = chain.gravity_moments(postures.q)
    turn = (
        adjoint(inverse(T) @ column)[:, :, 3:]
        * (M[:, 0] / np.abs(M[:, 1:]).max(initial=np.abs(M[:, 0]).max()))[:, None]
    )
    J = jlog6(log6(inverse(postures.T_base_hand) @ hand.poses(postures.q))) @ turn
    mine = found.N[:, :, found.group == NAMES.index("bending")][:, :, :3]
    scale = np.abs(mine).max() / np.abs(J).max()
    np.testing.assert_allclose(mine, scale * J, atol=1e-9)
    assert chain.is_prismatic(chain.joints[0]) and np.ptp(postures.q[:, chain.columns[0]]) > 0.1


@pytest.mark.parametrize("what", ["compliance", "half_gap"])
def test_what_was_taken_for_known_moves_the_geometry_as_its_interval_says(what):
    description, rng, tiny = rigid_robot.described(), np.random.default_rng(0), np.full(8, 1e-4)
    chain = chain_of(mjcf.urdf(), description)
    hand, parameters = nominal_hand(chain, nominal_frames(chain, description)), geometry_parameters(chain, description)
    parameters = replace(parameters, group=())
    truth, q = rigid_robot.defects(0), rigid_robot.random_angles(rng, 30)
    seen = rigid_robot.postures(truth, q)
    off = (1e-6 if what == "compliance" else 1e-5) * (np.array(chain.joints) == "arm_4_joint")
    tau = chain.gravity_torques(seen.q)
    delta = off * (tau if what == "compliance" else np.sign(tau))
    bent = replace(rigid_robot.postures(truth, q + delta), q=seen.q, covariance=seen.covariance)
    before, after = (fit(hand, parameters, some, tiny, tiny) for some in (seen, bent))
    none = TakenForKnown(np.zeros(8), np.zeros(8), np.zeros(2), np.zeros(2), np.zeros(8, dtype=bool))
    wider = with_gears(hand, parameters, before, seen, replace(none, **{what: off}))
    added = np.sqrt(np.diag(wider.covariance - before.covariance).clip(0.0))
    np.testing.assert_allclose(added, np.abs(after.theta - before.theta), atol=0.03 * added.max())
    read = with_gears(hand, parameters, before, seen, replace(none, read=off > 0.0, **{what: off}))
    zero = abs(float((off * (tau if what == "compliance" else np.sign(tau))).mean(axis=0).sum()))
    only = np.array(parameters.names) == "encoder.arm_4_joint.motor.offset"
    added = np.sqrt(np.diag(read.covariance - before.covariance).clip(0.0))
    np.testing.assert_allclose(added, zero * only, atol=0.03 * zero)


def test_a_column_that_leans_in_all_postures_moves_the_placements_as_its_interval_says():
    description, rng, tiny = rigid_robot.described(), np.random.default_rng(0), np.full(8, 1e-4)
    chain = chain_of(mjcf.urdf(), description)
    hand, parameters = nominal_hand(chain, nominal_frames(chain, description)), geometry_parameters(chain, description)
    parameters = replace(parameters, group=())
    seen = rigid_robot.postures(rigid_robot.defects(0), rigid_robot.random_angles(rng, 30))
    column = chain.poses(hand.angles(seen.q), chain.joints[0])
    B = from_vector(hand.base)
    lean = inverse(B) @ column @ from_vector(np.array([0, 0, 0, 5e-5, 0, 0])) @ inverse(column) @ B
    leaning = replace(seen, T_base_hand=lean @ seen.T_base_hand)
    before, after = (fit(hand, parameters, some, tiny, tiny) for some in (seen, leaning))
    known = TakenForKnown(np.zeros(8), np.zeros(8), np.zeros(2), np.array([5e-5, 0.0]), np.zeros(8, dtype=bool))
    wider = with_gears(hand, parameters, before, seen, known)
    added = np.sqrt(np.diag(wider.covariance - before.covariance).clip(0.0))
    moved = np.abs(after.theta - before.theta)
    assert moved[list(parameters.names).index("geometry.arm_1_joint.ry")] > 1e-5
    np.testing.assert_allclose(added, moved, atol=0.05 * added.max())
