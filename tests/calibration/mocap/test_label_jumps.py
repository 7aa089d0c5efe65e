"""Exchanges of labels that keep a body's shape: reported by the jump, corrected or masked, frames counted."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibration.mocap.labels import with_right_labels, without_jumps
from calibration.recording.schema import Body, Marker
from tests.doubles import rigid_robot

SQUARE = np.array([[0.1, 0.1, 0.0], [-0.1, 0.1, 0.0], [-0.1, -0.1, 0.0], [0.1, -0.1, 0.0]])
TRIANGLE = np.array([[0.05, 0.0, 0.0], [-0.05, 0.0, 0.0], [0.002, 0.12, 0.0]])  # isosceles to 2 mm
PYRAMID = np.array(
    [[-0.08, 0.11, 0.03], [-0.08, -0.11, 0.03], [0.06, 0.0, 0.1], [-0.1, 0.0, -0.1]]
)  # one plane of symmetry
T = np.arange(400) / 100.0


def seen(xyz: np.ndarray, speed: float = 2.0) -> np.ndarray:
    """Markers (n, m, 3) of a body that turns at up to `speed` [rad/s] and moves, with noise."""
    angle = speed * np.sin(T)
    R = Rotation.from_rotvec(angle[:, None] * [0.6, 0.0, 0.8]).as_matrix()
    p = np.einsum("nij,mj->nmi", R, xyz) + 0.3 * np.sin(T)[:, None, None] * [1.0, 0.5, 0.0]
    return p + 1e-4 * np.random.default_rng(0).normal(size=p.shape)


def exchanged(p: np.ndarray, rows: slice, order: list[int]) -> np.ndarray:
    out = p.copy()
    out[rows] = out[rows][:, order]
    return out


@pytest.mark.parametrize(("xyz", "order"), [
    (SQUARE, [1, 2, 3, 0]), (SQUARE, [2, 3, 0, 1]), (SQUARE, [1, 0, 3, 2]), (TRIANGLE, [1, 0, 2]),
])  # fmt: skip
@pytest.mark.parametrize("rows", [slice(100, 130), slice(300, 400), slice(0, 60)])
def test_an_exchange_that_keeps_the_shape_is_set_right(xyz, order, rows):
    p = seen(xyz)
    np.testing.assert_array_equal(without_jumps(xyz, T, exchanged(p, rows, order)), p)


def test_frames_are_counted_and_reported(truth, caplog):
    trial = rigid_robot.record(truth, rigid_robot.sweep(3, seconds=2.0), 12.0, np.random.default_rng(0), plate=False)
    body = Body(
        name="base", link="base_footprint", markers=[Marker(name=f"base{i}", xyz=p) for i, p in enumerate(SQUARE)]
    )
    position = trial.marker_position.copy()
    position[:, :4] = SQUARE
    wrong = exchanged(position, slice(100, 130), [1, 2, 3, 0, *range(4, 8)])
    found = with_right_labels([body], replace(trial, marker_position=wrong))
    np.testing.assert_array_equal(found.marker_position, position)
    assert "'base' exchanged: 30 frames corrected, 0 masked" in caplog.text


def test_exchanges_one_after_the_other_and_with_a_hidden_marker_are_set_right():
    p = seen(SQUARE)
    hidden = p.copy()
    hidden[90:150, 3] = np.nan
    wrong = exchanged(exchanged(p, slice(100, 130), [1, 2, 3, 0]), slice(115, 200), [2, 3, 0, 1])
    np.testing.assert_array_equal(without_jumps(SQUARE, T, wrong), p)
    np.testing.assert_array_equal(without_jumps(SQUARE, T, exchanged(hidden, slice(100, 130), [1, 2, 3, 0])), hidden)


@pytest.mark.parametrize("hidden", range(4))
def test_an_exchange_that_the_markers_left_in_sight_do_not_show_by_their_shape_is_set_right(hidden):
    right = seen(PYRAMID)
    right[80:160, hidden] = np.nan
    wrong = exchanged(right, slice(100, 130), [1, 0, 2, 3])
    np.testing.assert_array_equal(without_jumps(PYRAMID, T, wrong), right)


def test_where_half_of_the_frames_have_either_order_nobody_knows():
    assert np.isnan(without_jumps(SQUARE, T, exchanged(seen(SQUARE), slice(220, 400), [1, 2, 3, 0]))).all()


def test_a_body_that_turns_is_left_alone_though_it_was_hidden_meanwhile():
    quarter = np.concatenate([np.zeros(150), np.linspace(0.0, np.pi / 2.0, 100), np.full(150, np.pi / 2.0)])
    p = np.einsum("nij,mj->nmi", Rotation.from_rotvec(quarter[:, None] * [0.0, 0.0, 1.0]).as_matrix(), SQUARE)
    assert without_jumps(SQUARE, T, p) is p
    p[150:250] = np.nan  # a quarter turn within a second: 1.6 rad/s
    assert without_jumps(SQUARE, T, p) is p
    fast = seen(SQUARE, 9.0)
    assert without_jumps(SQUARE, T, fast) is fast
    jolted = seen(SQUARE)
    jolted[200:] += [0.3, 0.0, 0.0]  # moved as a whole: another matter than labels
    assert without_jumps(SQUARE, T, jolted) is jolted


@pytest.mark.parametrize("xyz", [SQUARE, SQUARE * [[1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.3, 1.0, 1.0], [1.0, 1.0, 1.0]]])
def test_hidden_markers_are_not_exchanged_ones(xyz):
    """One marker found again while another is lost, at random or for a while: every frame stays as it was recorded."""
    p, rng = seen(xyz), np.random.default_rng(1)
    handed_over = p.copy()
    handed_over[100:120, 0], handed_over[120:140, 1] = np.nan, np.nan
    at_random = np.where(rng.random(p.shape[:2])[..., None] < 0.2, np.nan, p)
    blocks = p.copy()
    for k in range(4):
        for start in rng.integers(0, 350, 3):
            blocks[start : start + 50, k] = np.nan
    for hidden in (handed_over, at_random, blocks):
        np.testing.assert_array_equal(without_jumps(xyz, T, hidden), hidden)
