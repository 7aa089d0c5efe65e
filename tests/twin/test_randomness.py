import numpy as np

from twin.draw import draw
from twin.randomness import generator


def test_streams_depend_on_their_names_and_not_on_order():
    a = generator(3, "placement", "arm_1_joint").normal(size=4)
    generator(3, "something else").normal(size=100)
    np.testing.assert_array_equal(a, generator(3, "placement", "arm_1_joint").normal(size=4))
    assert not np.array_equal(a, generator(3, "placement", "arm_2_joint").normal(size=4))
    assert not np.array_equal(a, generator(4, "placement", "arm_1_joint").normal(size=4))


def test_one_seed_is_one_robot(config, nominal):
    numbers = [[p.value for d in draw(config, nominal, s).defects for p in d.parameters()] for s in (5, 5, 6)]
    assert numbers[0] == numbers[1] != numbers[2]


def test_placements_have_the_width_the_scenario_gives(config, nominal):
    xi = np.array([[d.xi for d in draw(config, nominal, s).defects[:8]] for s in range(100)])
    np.testing.assert_allclose(xi[..., :3].std(), config.widths.placement_translation, rtol=0.05)
    np.testing.assert_allclose(xi[..., 3:].std(), config.widths.placement_rotation, rtol=0.05)
