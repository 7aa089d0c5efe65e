"""Intervals of a fit whose model leaves something out."""

import numpy as np

from calibration.inference.map_estimate import Fit
from calibration.inference.marginal_likelihood import Hyperparameters
from calibration.inference.misfit import Departures, misfit
from calibration.inference.parameters import ParameterSet
from calibration.inference.residual import Linearised, Noise

P, ROWS = 8, 60
RNG = np.random.default_rng(0)
J, N = RNG.normal(size=(ROWS, 3, P)), RNG.normal(size=(ROWS, 3, 12))
N = 100.0 * (N + 1.5 * np.concatenate([J[:, :, :6], 0.0 * J[:, :, :6]], axis=2))  # parameters absorb much of it
WHAT = Departures(N, np.repeat([0, 1], 6), ("load", "wobble"), 1e-2)
PARAMETERS = ParameterSet(tuple("abcdefgh"), ("m",) * P, np.zeros(P), np.full(P, np.inf))
NONE = Noise(("markers",), np.zeros(3, dtype=int), np.ones(1), np.ones(1), np.zeros(1, bool), np.ones(1, bool))


def fitted(size: float, seed: int) -> Fit:
    """Of zeros, with noise of 1 and departures of the first group."""
    rng = np.random.default_rng(seed)
    y = rng.normal(size=(ROWS, 3)) + N[:, :, :6] @ (size * rng.normal(size=6))
    A = J.reshape(-1, P)
    theta = np.linalg.lstsq(A, y.ravel(), rcond=None)[0]
    eye = np.broadcast_to(np.eye(3), (ROWS, 3, 3))
    at = Linearised(theta, (A @ theta - y.ravel()).reshape(ROWS, 3), J, eye)
    return Fit(at, NONE, Hyperparameters(np.ones(1), np.ones(0)), np.linalg.inv(A.T @ A), eye, True)


def covered(covariances, errors) -> float:
    z = errors / np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    return float((np.abs(z) < 1.96).mean())


def test_intervals_hold_though_parameters_absorb_what_the_model_leaves_out():
    fits = [fitted(8e-3, seed) for seed in range(60)]
    errors = np.array([fit.theta for fit in fits])
    found = [misfit(fit, PARAMETERS, WHAT) for fit in fits]
    assert covered(np.array([fit.covariance for fit in fits]), errors) < 0.5
    assert 0.88 <= covered(np.array([one.covariance for one in found]), errors) <= 1.0
    assert np.mean([[name for name, _ in one.seen] == ["load"] for one in found]) > 0.9


def test_a_model_that_leaves_nothing_out_keeps_its_intervals():
    found = [misfit(fitted(0.0, seed), PARAMETERS, WHAT) for seed in range(100)]
    kept = [not one.size.any() for one in found]
    assert np.mean(kept) >= 0.9
    np.testing.assert_array_equal(found[kept.index(True)].covariance, fitted(0.0, kept.index(True)).covariance)
    assert np.mean([len(one.seen) > 0 for one in found]) <= 0.03
