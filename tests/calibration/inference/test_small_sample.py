"""Sizes of random errors that few data show widen the parameters' covariance."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.inference.map_estimate import Fit
from calibration.inference.marginal_likelihood import Hyperparameters
from calibration.inference.residual import Linearised, Noise
from calibration.inference.small_sample import small_sample_covariance


def two_instruments(counts, sigma):
    """One length read by two instruments of sizes of errors that are not known."""
    group, n = np.repeat([0, 1], counts), sum(counts)
    B = np.eye(2)[group][:, None, :]
    at = Linearised(np.zeros(1), np.zeros((n, 1)), np.ones((n, 1, 1)), B)
    free, none = np.ones(2, dtype=bool), np.zeros(2, dtype=bool)
    noise = Noise(("one", "other"), np.arange(2), sigma, np.full(2, 1e-9), free, none)
    covariance = np.array([[1.0 / (np.array(counts) / sigma**2).sum()]])
    return Fit(at, noise, Hyperparameters(sigma, np.zeros(0)), covariance, noise.whitener(at, sigma), True)


@pytest.mark.parametrize("counts", [(20, 30), (40, 10)])
def test_a_mean_weighted_by_estimated_variances_is_as_uncertain_as_meier_has_it(counts):
    """1 / sum(w) (1 + 4 sum p (1 - p) / nu); Meier, Biometrics 1953."""
    sigma = np.array([1.0, 1.7])
    fit = two_instruments(counts, sigma)
    share = np.array(counts) / sigma**2 * fit.covariance[0, 0]
    expected = 1.0 + 4.0 * (share * (1.0 - share) / (np.array(counts) - 1)).sum()
    found = float(small_sample_covariance(fit)[0, 0] / fit.covariance[0, 0])
    assert found - 1.0 == pytest.approx(expected - 1.0, rel=0.1)


def test_sizes_that_are_stated_widen_nothing():
    fit = two_instruments((5, 5), np.array([1.0, 1.7]))
    stated = replace(fit, noise=replace(fit.noise, free=np.zeros(2, dtype=bool)))
    np.testing.assert_array_equal(small_sample_covariance(stated), fit.covariance)
