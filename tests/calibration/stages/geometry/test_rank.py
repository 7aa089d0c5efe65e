"""What postures tell of 60 parameters (two frames, eight placements): how many combinations, whatever their order."""

import numpy as np
import pytest

import mjcf
from calibration.inference.identifiability import identifiability
from calibration.inference.parameters import ParameterSet
from calibration.robot.chain import chain_of_frames
from calibration.robot.hand import nominal_hand
from tests.doubles import rigid_robot

N_PARAMETERS = 60


def reported(q, tool="gripper_grasping_frame", hand=(0.02, -0.03, 0.1, 0.1, 0.2, 0.0), components=6):
    chain = chain_of_frames(mjcf.urdf(), rigid_robot.JOINTS, "base_footprint", tool)
    model = nominal_hand(chain, np.r_[0.1, -0.2, 0.3, 0.02, 0.01, -0.5, hand])
    J = model.poses_and_derivatives(q).J[:, :components, :N_PARAMETERS]
    names, units = model.names[:N_PARAMETERS], ("m", "m", "m", "rad", "rad", "rad") * 10
    parameters = ParameterSet(names, units, np.zeros(N_PARAMETERS), np.full(N_PARAMETERS, np.inf))
    return identifiability((J / 1e-4).reshape(-1, N_PARAMETERS), parameters)


@pytest.mark.parametrize(
    "torso, components, where, rank",
    [
        (True, 6, {}, 36),
        (False, 6, {}, 34),
        (True, 3, {}, 33),
        (True, 3, {"tool": "arm_7_link", "hand": np.r_[0.0, 0.0, 0.1, np.zeros(3)]}, 31),
    ],
    ids=["6D markers", "torso still", "one marker", "one marker on the axis of arm_7"],
)
def test_the_rank_is_that_of_the_model_for_any_postures_in_any_order(torso, components, where, rank):
    """4 R + 2 P + 6, less the three of the hand's rotation for one marker.

    On the axis of arm_7 it hardly moves with arm_7: as many as for one marker carried by arm_6, 29, and the two of its
    small circle about the axis.
    """
    found = []
    for seed in range(3):
        q = rigid_robot.random_angles(np.random.default_rng(seed), 60, torso)
        found += [reported(rows, components=components, **where) for rows in (q, q[::-1], q[np.argsort(q[:, 3])])]
    assert {(known.rank, known.clear) for known in found} == {(rank, True)}
    assert len({known.base for known in found[:3]}) == len({known.status for known in found[:3]}) == 1


@pytest.mark.parametrize("torso, on_the_axis", [(True, 31), (False, 29)])
def test_off_the_axis_of_arm_7_two_more_are_seen_in_proportion_to_the_distance_never_one(torso, on_the_axis):
    """They are arm_7's tilts about the two axes across its own: a marker at the distance a moves by a times the tilt.

    So 31 or 33 of one marker. 29 of a marker on arm_6 plus three coordinates on arm_7 would be 32, but 29 hold the
    coordinate along the axis already.
    """
    q, weak = rigid_robot.random_angles(np.random.default_rng(0), 60, torso), []
    for distance in (1e-4, 1e-3):
        known = reported(q, tool="arm_7_link", hand=np.r_[distance, 0.0, 0.1, np.zeros(3)], components=3)
        assert known.rank == on_the_axis + 2 and known.clear
        weak.append(known.singular_values[on_the_axis : on_the_axis + 2] / known.singular_values[0])
        assert known.singular_values[on_the_axis - 1] > 10.0 * known.singular_values[on_the_axis]
    np.testing.assert_allclose(weak[1] / weak[0], 10.0, rtol=0.01)
