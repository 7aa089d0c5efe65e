import numpy as np

from twin.campaign import sample
from twin.defects import Placement
from twin.random_streams import generator


def test_streams_depend_on_their_names_and_not_on_order():
    a = generator(3, "placement", "arm_1_joint").normal(size=4)
    generator(3, "something else").normal(size=100)
    np.testing.assert_array_equal(a, generator(3, "placement", "arm_1_joint").normal(size=4))
    assert not np.array_equal(a, generator(3, "placement", "arm_2_joint").normal(size=4))
    assert not np.array_equal(a, generator(4, "placement", "arm_1_joint").normal(size=4))


def test_one_seed_is_one_robot(config, nominal):
    numbers = [[p.value for d in sample(config, s).defects for p in d.parameters()] for s in (5, 5, 6)]
    assert numbers[0] == numbers[1] != numbers[2]


def test_placements_have_the_width_the_scenario_gives(config, nominal):
    xi = np.array([[d.xi for d in sample(config, s).defects if isinstance(d, Placement)] for s in range(100)])
    np.testing.assert_allclose(xi[..., :3].std(), config.widths.placement_translation, rtol=0.05)
    np.testing.assert_allclose(xi[..., 3:].std(), config.widths.placement_rotation, rtol=0.05)


def test_marker_errors_do_not_move_their_clusters_frame(lab):
    for cluster in lab.robot.clusters:
        true = cluster.nominal + cluster.shift
        p, q = cluster.nominal - cluster.nominal.mean(axis=0), true - true.mean(axis=0)
        U, _, Vt = np.linalg.svd(q.T @ p)
        R = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
        np.testing.assert_allclose(R, np.eye(3), atol=1e-9)
        np.testing.assert_allclose(true.mean(axis=0), cluster.nominal.mean(axis=0), atol=1e-15)
        assert np.abs(cluster.shift).max() > 1e-5
