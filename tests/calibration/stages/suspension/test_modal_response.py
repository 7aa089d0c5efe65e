import numpy as np
import pytest
from scipy.signal import lsim

from calibration.stages.suspension.modal_response import modes_of
from tests.doubles.moving_base import smooth

STEP = 0.01
NONE = np.zeros((6, 6))


def positive(rng, scale):
    A = rng.normal(size=(6, 6))
    return scale * (A @ A.T + 6.0 * np.eye(6))


def test_the_response_is_that_of_the_differential_equation():
    rng = np.random.default_rng(0)
    K, C, M = positive(rng, 1.0), positive(rng, 0.05), positive(rng, 0.01)
    w = np.cumsum(rng.normal(size=(300, 6)), axis=0)
    w, t, eye = w - w[0], np.arange(300) * STEP, np.eye(6)
    first = (-np.linalg.solve(C, K), np.linalg.inv(C), eye, NONE)
    np.testing.assert_allclose(modes_of(K, C, NONE).respond(w, STEP), lsim(first, w, t)[1], atol=1e-12)
    A = np.block([[NONE, eye], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    second = (A, np.vstack([NONE, np.linalg.inv(M)]), np.hstack([eye, NONE]), NONE)
    np.testing.assert_allclose(modes_of(K, C, M).respond(w, STEP), lsim(second, w, t)[1], atol=1e-12)


def test_forward_and_inverse_are_a_round_trip():
    rng = np.random.default_rng(1)
    K, C = positive(rng, 1e4), positive(rng, 1e2)
    x = smooth(rng, 20.0, np.full(6, 1e-3), fastest=1.0)
    w = x @ K.T + np.gradient(x, STEP, axis=0) @ C.T
    np.testing.assert_allclose(modes_of(K, C, NONE).respond(w, STEP), x, atol=2e-3 * np.abs(x).max())


@pytest.mark.parametrize("damping", [0.0, 1e-9])
def test_springs_without_dampers_answer_at_once(damping):
    rng = np.random.default_rng(2)
    K, w = positive(rng, 1e5), rng.normal(size=(50, 6))
    x = modes_of(K, damping * K, NONE).respond(w, STEP)
    np.testing.assert_allclose(x, np.linalg.solve(K, w.T).T, atol=1e-5 * np.abs(x).max())


def test_a_mode_that_does_not_settle_is_reported():
    K, C = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, 0.01]), np.eye(6)
    assert modes_of(K, C, NONE).settling == pytest.approx(100.0)
    K[5, 5] = -1.0
    assert modes_of(K, C, NONE).settling == np.inf
    assert modes_of(np.eye(6), NONE, NONE).settling == 0.0
