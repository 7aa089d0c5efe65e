"""What a warning's cause may have moved is in the intervals."""

import numpy as np

from calibration.inference.parameters import Combination, Model, Parameter, widened


def model() -> Model:
    parameters = tuple(Parameter(name, "m", 0.0, 1.0, 1.0, "estimated") for name in "abc")
    return Model("model_2", parameters, (Combination("a", np.array([1.0, 1.0, 0.0]), 2.0, 2.0),), np.eye(3))


def test_intervals_grow_by_what_one_cause_moves_together():
    found = widened(model(), [(("a", 3.0), ("b", -3.0), ("other", 9.0))])
    np.testing.assert_allclose(found.covariance, np.eye(3) + 9.0 * np.array([[1, -1, 0], [-1, 1, 0], [0, 0, 0]]))
    np.testing.assert_allclose([p.sigma for p in found.parameters], [np.sqrt(10.0), np.sqrt(10.0), 1.0])
    assert found.combinations[0].sigma == 2.0  # a + b stays
    np.testing.assert_allclose(found.random_covariance, np.eye(3))  # it is no random error
    assert [p.value for p in found.parameters] == [1.0, 1.0, 1.0]


def test_a_model_without_the_parameter_stays():
    one = model()
    assert widened(one, [(("other", 1.0),)]) is one
