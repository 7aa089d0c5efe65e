"""A body of markers that slips between two postures is named, and the frame's interval includes the slip."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.numerics.lie import from_vector, inverse
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.stages.geometry.remounted import remounted
from calibration.stages.geometry.stage import calibrate_geometry
from tests.calibration.stages.geometry.test_geometry import with_play
from tests.doubles import rigid_robot

SLIP = np.array([0.0, 0.005, 0.0, 0.0, 0.0, 0.0])


def named(chain, slip=None, body="hand", seed=1):
    """What is found in 20 postures, a body moved by `slip` from the ninth on."""
    lab, q = rigid_robot.described(), rigid_robot.near_postures(np.random.default_rng(seed), 20)
    postures = with_play(rigid_robot.defects(seed), q, seed)
    if slip is not None:
        T, X = postures.T_base_hand.copy(), from_vector(slip)
        T[8:] = T[8:] @ X if body == "hand" else inverse(X) @ T[8:]
        postures = replace(postures, T_base_hand=T)
    model, _ = calibrate_geometry(chain, lab, postures)
    return list(remounted(hand_of(model, chain, nominal_frames(chain, lab)), model, postures, lab))


@pytest.mark.parametrize("body, prefix", [("hand", "frame.tool.hand"), ("base", "frame.base.base")])
def test_a_body_that_slips_is_named_and_counted_in_its_interval(chain, body, prefix):
    (found,) = named(chain, SLIP, body)
    assert f"markers of the {body} are elsewhere from posture 8 on" in found.message
    (moved,) = found.moves
    assert {name.rpartition(".")[0] for name, _ in moved} == {prefix}
    np.testing.assert_allclose(np.abs([size for _, size in moved][:3]), SLIP[:3], atol=2.5e-3)


@pytest.mark.parametrize("seed", range(2))
def test_nothing_is_named_where_nothing_slipped(chain, seed):
    assert not named(chain, seed=seed)
