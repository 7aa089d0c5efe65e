"""Markers that move against each other on a body that moves."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibration.errors import NotEnoughData
from calibration.mocap.cluster_shape import per_coordinate, shape_change
from calibration.recording.schema import Body, Marker
from calibration.recording.trial import Trial

DRAWN = np.array([[0.2, 0.0, 0.0], [-0.1, 0.15, 0.0], [-0.1, -0.15, 0.02], [0.0, 0.0, 0.1]])
T = np.arange(0.0, 12.0, 0.01)


def seen(places, moving=True):
    """Markers (n, m, 3) [m, lab] that are at places (n, m, 3) of a body that turns by 1 rad and goes about."""
    angle = moving * np.sin(0.5 * T)
    R = Rotation.from_rotvec(angle[:, None] * [0.6, 0.0, 0.8]).as_matrix()
    return np.einsum("nij,nmj->nmi", R, places) + 0.3 * angle[:, None, None] * [1.0, 0.5, 0.0]


def of(positions):
    m = positions.shape[1]
    body = Body(name="b", link="base_footprint", markers=[Marker(name=f"b{k}", xyz=DRAWN[k]) for k in range(m)])
    names, nothing = tuple(marker.name for marker in body.markers), np.zeros((0, 0))
    trial = Trial(
        id="a", joint=(), t_robot=np.zeros(0), q_motor=nothing, q_link=nothing, v_motor=nothing, effort=nothing,
        q_command=nothing, marker=names, marker_body=("b",) * m, t_mocap=T[: len(positions)], marker_position=positions,
    )  # fmt: skip
    return shape_change(body, trial)


@pytest.mark.parametrize("m", [3, 4])
def test_a_rigid_body_keeps_its_shape_however_it_was_drawn(m):
    """Mounted 2 mm from the drawing, turning by a radian: that is no change."""
    mounted = DRAWN[:m] + 2e-3 * np.random.default_rng(0).normal(size=(m, 3))
    assert per_coordinate(of(seen(np.tile(mounted, (len(T), 1, 1)))).x) < 1e-6


@pytest.mark.parametrize("m", [3, 4])
def test_two_markers_that_part_are_reported_with_their_size_wherever_the_body_turns(m):
    line = (DRAWN[1] - DRAWN[0]) / np.linalg.norm(DRAWN[1] - DRAWN[0])
    places = np.tile(DRAWN[:m], (len(T), 1, 1))
    places[T > 5.0, 0] -= 1e-4 * line
    places[T > 5.0, 1] += 1e-4 * line
    found = of(seen(places))
    parted = found.x[(found.t > 6.0) & (found.t < 11.0)]
    apart = (parted.reshape(-1, m, 3)[:, 1] - parted.reshape(-1, m, 3)[:, 0]) @ line
    if m == 3:  # of the four some of it is taken up by what fits best
        np.testing.assert_allclose(apart, 2e-4, atol=2e-7)
        assert per_coordinate(parted) == pytest.approx(np.sqrt(2.0 / 3.0) * 1e-4, rel=0.01)
    assert 1e-4 < apart.min()


@pytest.mark.parametrize("m", [3, pytest.param(4, marks=pytest.mark.slow)])
def test_errors_of_all_markers_have_their_size_by_coordinate(m):
    rng, found = np.random.default_rng(1), []
    for _ in range(200):
        amplitude = 1e-4 * rng.normal(size=(m, 3))
        places = DRAWN[:m] + (T > 2.0)[:, None, None] * amplitude
        found.append(per_coordinate(of(seen(places)).x[500:1000]) ** 2)
    assert np.sqrt(np.mean(found)) == pytest.approx(1e-4, rel=0.05)


def test_too_few_markers_or_samples_are_reported():
    with pytest.raises(NotEnoughData, match="needs 3 markers"):
        of(seen(np.tile(DRAWN[:2], (len(T), 1, 1))))
    with pytest.raises(NotEnoughData, match="less than one second"):
        of(seen(np.tile(DRAWN, (len(T), 1, 1)))[:50])
