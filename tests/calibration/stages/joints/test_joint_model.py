"""The printed formula, its terms, its domain."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.errors import ShapeError
from calibration.stages.joints.model import JointModel, basis_of, exponents, monomials, not_zero


@pytest.fixture
def model() -> JointModel:
    powers = exponents("printed", 2)
    A, B = np.array([1e-3, -2e-4, 3e-4, 5e-5]), np.array([-1e-3, 1e-4, 2e-4, -4e-5])
    return JointModel("elbow", "printed", 2, powers, (), 40.0, A, B, np.array([[-1.0, 1.5], [-8.0, 4.0]]), 0.02)


def test_terms_are_the_three_sets() -> None:
    assert exponents("printed", 2) == ((1, 1), (1, 2), (2, 1), (2, 2))
    assert exponents("tensor", 1) == ((0, 0), (0, 1), (1, 0), (1, 1))
    assert exponents("total", 2) == ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (2, 0))
    assert [len(exponents("tensor", n)) for n in range(6)] == [(n + 1) ** 2 for n in range(6)]
    assert [len(exponents("total", n)) for n in range(6)] == [(n + 1) * (n + 2) // 2 for n in range(6)]
    assert exponents("printed", 0) == ()


def test_discrepancy_is_the_printed_formula(model: JointModel) -> None:
    theta, tau, dq = 0.7, -3.1, 0.03
    S = 1.0 / (1.0 + np.exp(-40.0 * dq))
    C_r = 1e-3 * theta * tau - 2e-4 * theta * tau**2 + 3e-4 * theta**2 * tau + 5e-5 * theta**2 * tau**2
    C_l = -1e-3 * theta * tau + 1e-4 * theta * tau**2 + 2e-4 * theta**2 * tau - 4e-5 * theta**2 * tau**2
    found = model.discrepancy(np.array([theta]), np.array([tau]), np.array([dq]))[0]
    assert found == pytest.approx(C_r * S + C_l * (1.0 - S), rel=1e-14)


def test_at_rest_it_is_the_mean_of_both_flanks_and_far_off_one_of_them(model: JointModel) -> None:
    theta, tau = np.array([0.4]), np.array([2.0])
    right, left, rest = (model.discrepancy(theta, tau, np.array([dq]))[0] for dq in (50.0, -50.0, 0.0))
    M = monomials(theta, tau, model.powers)
    assert (right, left) == (pytest.approx((M @ model.A)[0]), pytest.approx((M @ model.B)[0]))
    assert rest == pytest.approx(0.5 * (right + left))


def test_outside_the_domain_the_nearest_value_inside_is_used_and_flagged(model: JointModel) -> None:
    theta, tau, dq = np.array([3.0, -2.0, 0.0, 0.5]), np.array([0.0, 9.0, -9.0, 1.0]), np.full(4, 0.2)
    inside = np.array([1.5, -1.0, 0.0, 0.5]), np.array([0.0, 4.0, -8.0, 1.0])
    np.testing.assert_array_equal(model.discrepancy(theta, tau, dq), model.discrepancy(*inside, dq))
    np.testing.assert_array_equal(model.is_outside(theta, tau), [True, True, True, False])
    assert not model.is_outside(*model.domain).any()


def test_the_choice_none_says_zero_everywhere(model: JointModel) -> None:
    none = replace(model, degree=None, powers=(), A=np.zeros(0), B=np.zeros(0))
    far = np.array([0.0, 99.0])
    assert not none.discrepancy(far, far, far).any()
    assert not none.is_outside(far, far).any()


def test_coefficients_of_another_number_than_the_terms_are_an_error(model: JointModel) -> None:
    with pytest.raises(ShapeError, match="elbow: A"):
        replace(model, A=np.zeros(3))
    with pytest.raises(ShapeError, match="elbow: domain"):
        replace(model, domain=np.zeros(2))


@pytest.mark.parametrize(("terms", "degree"), [("printed", 3), ("tensor", 3), ("total", 5)])
def test_scaled_coefficients_say_the_same_in_printed_units(terms: str, degree: int) -> None:
    rng = np.random.default_rng(3)
    powers = exponents(terms, degree)  # type: ignore[arg-type]
    domain = np.array([[-2.2, 0.4], [-21.0, -3.0]])
    basis, a = basis_of(powers, domain), rng.normal(size=len(powers))
    theta, tau = rng.uniform(*domain[0], 50), rng.uniform(*domain[1], 50)
    assert np.abs(basis(theta, tau)).max() <= 1.0 + 1e-12
    printed = monomials(theta, tau, powers) @ (basis.to_printed() @ a)
    np.testing.assert_allclose(printed, basis(theta, tau) @ a, atol=1e-12)


def test_terms_of_a_vertical_axis_are_dropped() -> None:
    theta, tau = np.linspace(-1.0, 1.0, 9), np.full(9, 1e-9)
    assert not_zero(exponents("total", 2), theta, tau) == ((0, 0), (1, 0), (2, 0))
    assert not_zero(exponents("printed", 3), theta, tau) == ()
    assert not_zero(exponents("total", 1), theta, tau + 1.0) == exponents("total", 1)
