"""Directions in which robots depart from a rigid chain."""

import numpy as np

import mjcf
from calibration.numerics.lie import adjoint, inverse, jlog6, log6
from calibration.robot.chain import chain_of
from calibration.robot.hand import nominal_hand
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.geometry.departures import NAMES, departures
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
