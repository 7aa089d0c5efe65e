"""Sizes of random errors that few data show widen the parameters' covariance."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.inference.map_estimate import Fit
from calibration.inference.marginal_likelihood import Hyperparameters, log_marginal, maximised
from calibration.inference.parameters import Prior
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


def test_an_error_that_a_datasheet_states_is_never_found_to_be_zero():
    """Ten readings of noise 1 that scatter by .9: of ln(1 + v) n / 2 + .81 n / (1 + v) / 2 - ln s the root."""
    n, sources, none = 10, np.array([0, 1]), np.zeros(0)
    r = np.sqrt(0.81) * np.resize([1.0, -1.0], n)[:, None]
    at = Linearised(np.zeros(1), r, np.zeros((n, 1, 1)), np.ones((n, 1, 2)))
    one, free = np.ones(2), np.array([False, True])
    noise = Noise(("markers", "reading"), sources, one, np.array([1.0, 1e-4]), free, ~free)
    prior, start = Prior(np.zeros(1), np.ones(1), np.array([-1])), Hyperparameters(one, none)
    plain, present = (maximised(at, noise, prior, start, 1e-6, present=p)[0].noise[1] for p in (False, True))
    v = np.roots([n - 1, 0.19 * n - 2, -1.0]).max()
    assert plain < 1e-3
    assert present == pytest.approx(np.sqrt(v), rel=1e-3)
    by_v = log_marginal(at, noise, prior, Hyperparameters(np.array([1.0, 0.5]), none), True).slope[1]
    ends = [
        log_marginal(at, noise, prior, Hyperparameters(np.sqrt([1.0, w]), none), True).value for w in (0.249, 0.251)
    ]
    assert by_v == pytest.approx((ends[1] - ends[0]) / 0.002, rel=1e-3)
