from dataclasses import replace

import numpy as np
import pytest

from calibration import load
from calibration.mocap.cluster_pose import poses_of
from calibration.mocap.labels import relabelled_trials, with_right_labels
from calibration.mocap.postures import readings_at
from calibration.recording.clock import Clock
from calibration.recording.schema import Body, Marker
from tests.doubles import rigid_robot

SHARED = Clock("robot", 0.0, 0.0, np.zeros((2, 2)), 0.0, 1e-4)


@pytest.fixture(scope="module")
def trial(truth):
    return rigid_robot.record(truth, rigid_robot.sweep(3, seconds=2.0), 12.0, np.random.default_rng(0), plate=False)


@pytest.fixture(scope="module")
def bodies():
    return rigid_robot.described().bodies


def swapped(trial, rows, a, b):
    position = trial.marker_position.copy()
    position[np.ix_(rows, [a, b])] = position[np.ix_(rows, [b, a])]
    return replace(trial, marker_position=position)


def test_a_right_recording_is_left_alone(trial, bodies):
    found = with_right_labels(bodies, trial)
    assert found is trial


@pytest.mark.parametrize("pair", [(0, 1), (2, 3), (4, 5), (5, 7)])
def test_exchanged_labels_are_set_right_and_reported(trial, bodies, pair, caplog):
    found = with_right_labels(bodies, swapped(trial, np.arange(100, 130), *pair))
    np.testing.assert_array_equal(found.marker_position, trial.marker_position)
    name = "base" if pair[0] < 4 else "gripper"
    assert f"{name!r} exchanged: 30 frames corrected, 0 masked" in caplog.text


def test_a_foreign_marker_is_masked_alone(trial, bodies):
    position = trial.marker_position.copy()
    position[50:60, 6] += [0.3, -0.2, 0.1]
    found = with_right_labels(bodies, replace(trial, marker_position=position))
    assert np.isnan(found.marker_position[50:60, 6]).all()
    assert np.isfinite(np.delete(found.marker_position, 6, axis=1)).all()


@pytest.mark.parametrize("size", [0.01, 0.05])
def test_ghosts_of_a_moment_are_masked_whatever_their_size_and_what_stays_is_not(trial, bodies, size, caplog):
    position = trial.marker_position.copy()
    position[np.arange(20, 200, 9), 6] += [size, 0.0, -size]
    position[np.arange(23, 200, 7), 1] += [0.0, size, 0.0]
    hit = (position != trial.marker_position).any(axis=2)
    found = with_right_labels(bodies, replace(trial, marker_position=position))
    assert (np.isnan(found.marker_position).all(axis=2) == hit).all() and "its shape contradicts" in caplog.text
    moved = trial.marker_position.copy()
    moved[150:, 6] += [0.0, 0.002, 0.0]
    found = with_right_labels(bodies, replace(trial, marker_position=moved))
    np.testing.assert_array_equal(found.marker_position, moved)


def square(trial):
    """A base that is alike in four directions, standing still."""
    xyz = [[0.1, 0.1, 0.0], [-0.1, 0.1, 0.0], [-0.1, -0.1, 0.0], [0.1, -0.1, 0.0]]
    body = Body(name="base", link="base_footprint", markers=[Marker(name=f"base{i}", xyz=p) for i, p in enumerate(xyz)])
    position = trial.marker_position.copy()
    position[:, :4] = np.array(xyz)
    return body, replace(trial, marker_position=position)


def test_what_fits_in_two_ways_is_set_right_by_where_the_markers_were(trial):
    body, still = square(trial)
    for rows in (np.arange(10), np.arange(100, 130), np.arange(len(still.t_mocap) - 10, len(still.t_mocap))):
        found = with_right_labels([body], swapped(still, rows, 0, 1))
        np.testing.assert_array_equal(found.marker_position, still.marker_position)


def test_what_fits_in_two_ways_long_after_it_was_right_is_masked(trial):
    body, still = square(trial)
    found = with_right_labels([body], swapped(still, np.arange(240), 0, 1))
    assert np.isnan(found.marker_position[:135, :4]).all()
    np.testing.assert_array_equal(found.marker_position[145:], still.marker_position[145:])


def test_what_fits_in_two_ways_and_moved_as_far_as_they_are_apart_is_masked(trial):
    body, still = square(trial)
    turned = still.marker_position.copy()
    turned[:110, :4] = turned[:110, [1, 2, 3, 0]]  # the base turned by a quarter while its labels were wrong
    found = with_right_labels([body], swapped(replace(still, marker_position=turned), np.arange(100, 120), 0, 1))
    assert np.isnan(found.marker_position[100:120, :4]).all(axis=(1, 2)).any()
    true = still.marker_position[0, :4]
    for p in found.marker_position[100:120, :4]:
        assert np.isnan(p).all() or np.allclose(p, true) or np.allclose(p, true[[1, 2, 3, 0]])


def test_exchanged_labels_of_three_markers_in_sight_are_set_right_by_where_they_were(trial, bodies):
    position = trial.marker_position.copy()
    position[90:140, 6] = np.nan
    hidden = replace(trial, marker_position=position)
    found = with_right_labels(bodies, swapped(hidden, np.arange(100, 130), 4, 7))
    np.testing.assert_array_equal(found.marker_position, position)


def test_trials_of_a_dataset_have_their_labels_corrected(truth, trial, tmp_path):
    wrong = swapped(trial, np.arange(100, 130), 4, 5)
    dataset = load(rigid_robot.write(tmp_path / "d", [("swing", "calibration", "swing", wrong)]))
    ((_, raw),) = dataset.trials("calibration")
    np.testing.assert_allclose(raw.marker_position, wrong.marker_position, atol=1e-6)
    ((_, found),) = relabelled_trials(dataset, "calibration")
    np.testing.assert_allclose(found.marker_position, trial.marker_position, atol=1e-6)
    body = dataset.description.body("gripper")
    assert np.abs(poses_of(body, found).residual).max() < 1e-3


def test_readings_are_not_made_up_where_messages_were_lost(trial):
    lost = slice(200, 230)
    holed = replace(
        trial,
        **{
            f: np.delete(getattr(trial, f), lost, axis=0)
            for f in ("t_robot", "q_motor", "q_link", "v_motor", "effort", "q_command")
        },
    )
    t = trial.t_robot[190:240] + 0.002
    missing = np.isnan(readings_at(holed, SHARED, t, holed.q_motor)).all(axis=1)
    assert missing[10:39].all() and not missing[:9].any() and not missing[41:].any()
