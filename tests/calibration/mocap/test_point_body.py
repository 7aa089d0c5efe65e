"""A hand seen as a point: its place, the derivatives, and a drawn marker away from the body's frame."""

import numpy as np
import pytest

import mjcf
from calibration.mocap.postures import mean_postures
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Description
from calibration.robot.chain import chain_of
from calibration.robot.hand import nominal_hand
from calibration.stages.geometry.hand_residual import linearised
from calibration.stages.geometry.parameters import geometry_parameters
from tests.doubles import rigid_robot

RNG = np.random.default_rng(0)
WHOLE = rigid_robot.described()
FEW = WHOLE.hand_body.model_copy(update={"markers": WHOLE.hand_body.markers[:2]})
DESCRIBED: Description = WHOLE.model_copy(
    update={"bodies": tuple(FEW if b.name == FEW.name else b for b in WHOLE.bodies)}
)
CHAIN = chain_of(mjcf.urdf(), DESCRIBED)
PARAMETERS = geometry_parameters(CHAIN, DESCRIBED)
HAND = nominal_hand(CHAIN, PARAMETERS.nominal[:12])


@pytest.fixture(scope="module")
def postures():
    """Means of the nominal robot's markers, seen without noise from a base that stands somewhere."""
    low, high = (np.clip(x, -2.0, 2.0) for x in CHAIN.limits)
    q = RNG.uniform(low, high, size=(6, len(low)))
    base = next(b for b in DESCRIBED.bodies if b.name == "base")
    T = HAND.poses(q)
    markers = {m.name: np.tile(np.array(m.xyz), (6, 1)) for m in base.markers}
    markers |= {m.name: T[:, :3, :3] @ np.array(m.xyz) + T[:, :3, 3] for m in FEW.markers}
    p = np.stack(list(markers.values()), axis=1) @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]) + [1.0, 2.0, 0.5]
    body = ("base",) * len(base.markers) + (FEW.name,) * 2
    noise, still = np.full(p.shape, 1e-4), np.zeros(q.shape)
    return mean_postures(DESCRIBED, PostureMeans("p", CHAIN.measured, q, tuple(markers), body, p, noise, still))


def test_two_drawn_markers_are_their_mean(postures):
    assert FEW.is_point and postures.components == 3
    np.testing.assert_allclose(postures.point, np.mean([m.xyz for m in FEW.markers], axis=0))
    assert np.linalg.norm(FEW.point) > 0.01
    at = linearised(HAND, PARAMETERS.nominal, postures, PARAMETERS.names)
    np.testing.assert_allclose(at.r, 0.0, atol=1e-12)
    assert np.linalg.eigvalsh(postures.covariance).min() > 0.99e-8 / 2.0


def test_its_derivatives_are_those_of_its_place(postures):
    at, step = linearised(HAND, PARAMETERS.nominal, postures, PARAMETERS.names), 1e-6
    for k in range(len(PARAMETERS)):
        d = step * (np.arange(len(PARAMETERS)) == k)
        more, less = (linearised(HAND, PARAMETERS.nominal + s * d, postures, PARAMETERS.names).r for s in (1.0, -1.0))
        np.testing.assert_allclose(at.J[:, :, k], (more - less) / (2.0 * step), atol=1e-7)
