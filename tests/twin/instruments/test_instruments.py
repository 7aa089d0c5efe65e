import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from twin.instruments import Clock, motion_capture
from twin.instruments.sampling import averaged, interpolate, interpolate_poses


def test_a_clock_shows_what_its_definition_says():
    clock = Clock("robot", 3.9, 4e-5)
    shown, true = clock.ticks(100.0, 101.0, 100.0)
    np.testing.assert_allclose(shown * (1 + 4e-5) + 3.9, true, atol=1e-12)
    np.testing.assert_allclose(clock.reading(true), shown, atol=1e-12)
    assert true[0] >= 100.0 and true[-1] <= 101.0
    np.testing.assert_allclose(np.diff(shown), 0.01, atol=1e-12)


def test_interpolation_is_linear_and_poses_turn_evenly():
    grid = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(interpolate(np.array([0.234]), grid, 3.0 * grid[:, None])[0], [0.702])
    T = np.tile(np.eye(4), (11, 1, 1))
    T[:, :3, :3] = Rotation.from_rotvec(np.outer(grid, [0.0, 0.0, 0.4])).as_matrix()
    turned = interpolate_poses(np.array([0.55]), grid, T)[0]
    np.testing.assert_allclose(Rotation.from_matrix(turned[:3, :3]).as_rotvec(), [0.0, 0.0, 0.22], atol=1e-12)


def test_averaging_has_the_transfer_function_of_a_box():
    grid, f, width = np.arange(20001) * 1e-4, 20.0, 0.01
    x = np.sin(2 * np.pi * f * grid)[:, None]
    t = np.linspace(0.5, 1.5, 400)
    gain = np.sin(np.pi * f * width) / (np.pi * f * width)
    np.testing.assert_allclose(averaged(t, grid, x, width)[:, 0], gain * np.sin(2 * np.pi * f * t), atol=2e-4)


def test_markers_are_where_their_cluster_is(lab):
    cluster = lab.robot.clusters[0]
    T = np.tile(np.eye(4), (3, 1, 1))
    T[:, 0, 3] = [0.0, 1.0, 2.0]
    p = motion_capture.marker_positions(T, cluster)
    local = cluster.nominal[2] + cluster.shift[2]
    expected = cluster.T_link_body[:3, :3] @ local + cluster.T_link_body[:3, 3] + [2.0, 0.0, 0.0]
    np.testing.assert_allclose(p[2, 2], expected)


@pytest.mark.parametrize("name, least", [("base", 0.30), ("gripper", 0.12), ("shoulder", 0.12)])
def test_clusters_are_large_enough_to_tell_their_rotation(config, name, least):
    markers = np.array(list(config.instruments.bodies[name].markers.values()))
    edges = np.linalg.norm(markers[:, None] - markers[None], axis=2)[np.triu_indices(len(markers), 1)]
    assert edges.min() >= least
