"""Averaging over sets of parameters against the same sums written out, and its limits."""

from itertools import combinations
from math import comb

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from calibration.inference.model_averaging import averaged


def posterior(seed, n=12, p=5, noise=0.3, needed=(True, False, True)):
    """Posterior of p parameters with unit priors, the last three asked, and the data it comes from."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, p))
    true = np.r_[rng.normal(size=p - 3), np.where(needed, 1.0, 0.0)]
    y = A @ true + noise * rng.normal(size=n)
    covariance = np.linalg.inv(A.T @ A / noise**2 + np.eye(p))
    return A, y, covariance @ A.T @ y / noise**2, covariance


def test_the_average_is_the_sum_over_all_sets_by_their_evidence():
    A, y, theta, covariance = posterior(0, noise=1.5)
    found = averaged(theta, covariance, np.array([2, 3, 4]), np.ones(3))
    sets = [s for size in range(4) for s in combinations((2, 3, 4), size)]
    weights, means, squares = [], [], []
    for zero in sets:
        rest = [i for i in range(5) if i not in zero]
        B = A[:, rest]
        weights.append(multivariate_normal(cov=1.5**2 * np.eye(12) + B @ B.T).pdf(y) / comb(3, len(zero)))
        C, m = np.zeros((5, 5)), np.zeros(5)
        C[np.ix_(rest, rest)] = np.linalg.inv(B.T @ B / 1.5**2 + np.eye(len(rest)))
        m[rest] = C[np.ix_(rest, rest)] @ B.T @ y / 1.5**2
        means.append(m)
        squares.append(C + np.outer(m, m))
    w = np.array(weights) / sum(weights)
    mean = w @ np.array(means)
    np.testing.assert_allclose(found.theta, mean, atol=1e-10)
    np.testing.assert_allclose(found.covariance, np.einsum("m,mij->ij", w, squares) - np.outer(mean, mean), atol=1e-10)
    used = [sum(x for x, zero in zip(w, sets, strict=True) if i not in zero) for i in (2, 3, 4)]
    np.testing.assert_allclose(found.needed, used, atol=1e-10)


def test_what_is_needed_stays_and_what_is_not_goes():
    _, _, theta, covariance = posterior(1, n=400, noise=0.1)
    found = averaged(theta, covariance, np.array([2, 3, 4]), np.ones(3))
    assert found.needed == pytest.approx([1.0, 0.0, 1.0], abs=0.05)
    assert abs(found.theta[3]) < 0.1 * np.sqrt(covariance[3, 3])


def test_a_parameter_without_data_is_averaged_half_and_half():
    found = averaged(np.zeros(1), np.eye(1), np.array([0]), np.ones(1))
    assert found.needed == pytest.approx([0.5])
    assert found.covariance == pytest.approx(np.array([[0.5]]))


def test_parameters_that_are_zero_speak_against_the_next():
    """Of eight known to be zero within a hundredth of their width: an eighth of the odds of one that is alone."""
    alone, eighth = (averaged(np.zeros(k), 1e-4 * np.eye(k), np.arange(k), np.ones(k)).needed[-1] for k in (1, 8))
    assert alone == pytest.approx(0.01, rel=0.02)
    assert eighth == pytest.approx(alone / 8.0, rel=0.05)


def test_parameters_without_data_are_each_needed_with_one_half():
    np.testing.assert_allclose(averaged(np.zeros(4), np.eye(4), np.arange(4), np.ones(4)).needed, 0.5)


def test_of_many_parameters_the_clear_ones_are_not_asked():
    theta = np.r_[np.full(10, 0.01), 50.0, 60.0]
    found = averaged(theta, 0.01 * np.eye(12), np.arange(12), np.ones(12))
    np.testing.assert_array_equal(found.needed[10:], 1.0)
    np.testing.assert_array_equal(found.theta[10:], theta[10:])
