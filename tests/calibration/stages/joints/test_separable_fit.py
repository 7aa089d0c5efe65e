"""Variable projection: its derivative, and the truth from data made by the equations."""

import numpy as np
import pytest

from calibration.stages.joints.separable_fit import RHO, Problem, limit_of, project, search


def problem(rng: np.random.Generator, n: int = 400, rho: float = 37.0, noise: float = 0.0) -> Problem:
    """A problem whose data the model explains."""
    u, w = rng.uniform(-1.0, 1.0, (2, n))
    phi = np.stack([np.ones(n), u, w, u * w], axis=1)
    velocity = 0.4 * np.sin(np.arange(n) * 0.37)
    empty = Problem(phi, velocity, np.zeros(n))
    y = empty.design(rho) @ np.array([12.0, 2.0, -1.0, 0.5, -9.0, 1.0, 2.0, -0.3]) * 1e-3
    return Problem(phi, velocity, y + noise * rng.normal(size=n))


@pytest.mark.parametrize("rho", [3.0, 25.0, 300.0])
def test_derivative_of_the_projected_residual_matches_finite_differences(rho: float) -> None:
    made = problem(np.random.default_rng(0), noise=1e-3)
    step = 1e-5 * rho
    numeric = (project(made, rho + step).r - project(made, rho - step).r) / (2.0 * step)
    slope = project(made, rho).slope
    np.testing.assert_allclose(slope, numeric, atol=1e-7 * np.abs(slope).max() + 1e-12)


def test_derivative_holds_where_the_design_is_rank_deficient() -> None:
    made = problem(np.random.default_rng(0), noise=1e-3)
    doubled = Problem(np.hstack([made.phi, made.phi]), made.velocity, made.y)
    one, two = project(made, 30.0), project(doubled, 30.0)
    assert one.full_rank
    assert not two.full_rank
    np.testing.assert_allclose(two.slope, one.slope, atol=1e-12)


@pytest.mark.parametrize("rho", [5.0, 37.0, 400.0])
def test_search_finds_rho_and_coefficients_of_noise_free_data(rho: float) -> None:
    made = problem(np.random.default_rng(1), rho=rho)
    found = search(made)
    assert found.rho == pytest.approx(rho, rel=1e-6)
    np.testing.assert_allclose(found.x, np.array([12.0, 2.0, -1.0, 0.5, -9.0, 1.0, 2.0, -0.3]) * 1e-3, atol=1e-9)
    assert limit_of(found.rho) is None


def test_rho_the_data_do_not_tell_stops_at_a_limit() -> None:
    made = problem(np.random.default_rng(1), rho=1e6)
    assert limit_of(search(made).rho) is not None
    assert RHO[0] <= search(problem(np.random.default_rng(1), rho=0.1)).rho < 1.1 * RHO[0]


def test_search_is_pure() -> None:
    made = problem(np.random.default_rng(2), noise=1e-3)
    before = made.y.copy()
    one, two = search(made), search(made)
    assert one.rho == two.rho
    np.testing.assert_array_equal(one.x, two.x)
    np.testing.assert_array_equal(made.y, before)
