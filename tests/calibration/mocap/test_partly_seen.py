"""Dwells that show one or two markers of a body count in what these determine."""

from types import SimpleNamespace

import numpy as np
import pytest

from calibration.mocap.cluster_pose import body_poses
from calibration.mocap.partly_seen import Markers, completed
from calibration.mocap.postures import mean_poses
from calibration.numerics.lie import exp6, inverse, log6
from calibration.recording.schema import Marker
from tests.doubles import rigid_robot

HAND, BASE = (np.array(rigid_robot.BODIES[name][1]) for name in ("gripper", "base"))
SIGMA, N = 1e-5, 40


@pytest.fixture(scope="module")
def dwells():
    """True poses of base and hand, nominal ones of the tool, and the markers seen."""
    rng = np.random.default_rng(0)
    turns = np.column_stack([rng.normal(size=(N, 3)), rng.uniform(-2.0, 2.0, (N, 3))])
    tool = exp6(turns)
    X, Y = exp6(np.array([[0.1, 0.0, 0.3, 0.1, 0.0, 0.2], [0.0, 0.1, 0.0, 0.3, 0.0, 0.1]]))
    base = exp6(1e-3 * rng.normal(size=(N, 6)))
    hand = base @ X @ tool @ Y @ exp6(1e-2 * rng.normal(size=(N, 6)))
    seen = [
        np.einsum("nij,mj->nmi", T[:, :3, :3], x) + T[:, None, :3, 3] + SIGMA * rng.normal(size=(N, *x.shape))
        for T, x in ((base, BASE), (hand, HAND))
    ]
    return base, hand, tool, seen


def _of(x: np.ndarray, p: np.ndarray) -> Markers:
    return Markers(x, p, body_poses(x, p))


@pytest.mark.parametrize("left", [1, 2])
def test_few_markers_determine_what_they_show_and_the_others_dwells_the_rest(dwells, left):
    base, hand, tool, (p_base, p_hand) = dwells
    p_base, p_hand = p_base.copy(), p_hand.copy()
    p_base[:12, left:] = np.nan
    p_hand[8:20, left:] = np.nan  # four dwells lack markers of both
    found = completed(_of(BASE, p_base), _of(HAND, p_hand), tool, SIGMA**2)
    for rows, T, pose, p, x in (
        (slice(0, 12), base, found[0], p_base, BASE),
        (slice(8, 20), hand, found[1], p_hand, HAND),
    ):
        d = log6(inverse(T[rows]) @ pose.T[rows])
        squared = np.einsum("ni,nij,nj->n", d, np.linalg.inv(SIGMA**2 * pose.covariance[rows]), d)
        assert 3.0 < squared.mean() < 10.0  # 6 on average
        fitted = pose.T[rows, :3, :3] @ x[:left].T + pose.T[rows, :3, 3:]
        assert np.abs(fitted.swapaxes(1, 2) - p[rows, :left]).max() < 5.0 * SIGMA


def test_poses_of_three_markers_stay_as_they_are(dwells):
    _, _, tool, (p_base, p_hand) = dwells
    p_hand = p_hand.copy()
    p_hand[0, :2] = np.nan
    hand = _of(HAND, p_hand)
    base, found = completed(_of(BASE, p_base), hand, tool, SIGMA**2)
    np.testing.assert_array_equal(base.T, body_poses(BASE, p_base).T)
    np.testing.assert_array_equal(found.T[1:], hand.poses.T[1:])


def test_a_body_that_settles_is_not_bent_by_a_marker_hidden_for_a_while():
    names = [f"gripper{k}" for k in range(1, len(HAND) + 1)]
    body = SimpleNamespace(
        name="gripper", markers=[Marker(name=n, xyz=tuple(x)) for n, x in zip(names, HAND, strict=True)]
    )
    p = HAND + np.r_[np.linspace(2e-3, 0.0, 100), np.zeros(200)][:, None, None]
    dwell = [np.arange(100)]
    true = mean_poses(body, SimpleNamespace(id="a", marker=names, marker_position=p), dwell).T
    hidden = p.copy()
    hidden[30:100, 0] = np.nan
    found = mean_poses(body, SimpleNamespace(id="a", marker=names, marker_position=hidden), dwell).T
    np.testing.assert_allclose(log6(inverse(true) @ found), 0.0, atol=1e-9)
