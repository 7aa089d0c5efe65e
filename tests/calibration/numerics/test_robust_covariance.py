"""Intervals of fits to time series: noise whose autocorrelation is known in closed form, AR(1) with T = (1+a)/(1-a)."""

import numpy as np
import pytest
from scipy.signal import lfilter

from calibration.errors import NotEnoughData, ShapeError
from calibration.numerics.robust_covariance import ENOUGH, LONG, MANY, block_covariance, covering_sigma, widening


def series(rng, a, n, p):
    """Derivatives (n, 1, p), slow sines, and AR(1) noise (n, 1) of unit innovations."""
    t, columns = np.arange(n), [np.ones(n)]
    for k in range(1, (p + 1) // 2):
        phase = rng.uniform(0.0, 6.0)
        columns += [f(2.0 * np.pi * 3.0 * k * t / n + phase) for f in (np.sin, np.cos)]
    noise = lfilter([1.0], [1.0, -a], rng.normal(size=n + 300))[300:]
    return np.stack(columns, axis=1)[:, None, :p], noise[:, None]


def covered(a, n, trials, p, seeds):
    """Shares of the p parameters' 95 % intervals that hold the truth, by blocks and as if samples were independent."""
    hits, naive, found = [], [], None
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        J, e = zip(*(series(rng, a, n, p) for _ in range(trials)), strict=True)
        A, y = np.concatenate(J)[:, 0], np.concatenate(e)[:, 0]
        theta = np.linalg.lstsq(A, y, rcond=None)[0]
        r = y - A @ theta
        found = block_covariance(J, np.split(r[:, None], trials))
        white = r @ r / (len(r) - p) * np.linalg.inv(A.T @ A)
        for hit, C in ((hits, found.covariance), (naive, white)):
            hit.append(np.abs(theta) < 1.96 * np.sqrt(np.diag(C)))
    return np.mean(hits), np.mean(naive), found


@pytest.mark.parametrize(
    "a, n, trials, p",
    [
        (0.0, 500, 8, 3),
        pytest.param(0.8, 500, 8, 3, marks=pytest.mark.slow),
        (0.9, 4000, 1, 3),
        pytest.param(0.8, 250, 8, 21, marks=pytest.mark.slow),
    ],
)
def test_intervals_cover_whatever_the_autocorrelation(a, n, trials, p):
    by_block, naive, found = covered(a, n, trials, p, 150)
    assert 0.925 < by_block < 0.975  # 95 % within two and a half standard deviations of 150 draws with 3 of p apart
    assert naive < 0.8 or a == 0.0
    assert ENOUGH <= found.blocks <= MANY and found.length >= LONG * found.correlation
    assert p > 3 or found.correlation == pytest.approx((1.0 + a) / (1.0 - a), rel=0.25)


def test_few_blocks_are_reported_and_their_intervals_are_student_s():
    by_block, _, found = covered(0.95, 150, 8, 1, 300)
    assert found.blocks == 8 < ENOUGH
    assert 0.92 < by_block < 0.98


def test_a_prior_is_information_no_block_has():
    J, r = series(np.random.default_rng(0), 0.5, 400, 3)
    free, held = block_covariance([J], [r]).covariance, block_covariance([J], [r], np.array([0.0, 0.0, 1e9])).covariance
    assert held[2, 2] < 1e-6 * free[2, 2]
    assert held[0, 0] == pytest.approx(free[0, 0], rel=0.3)


def test_one_block_alone_has_no_covariance():
    J, r = series(np.random.default_rng(0), 0.5, 5, 1)
    with pytest.raises(NotEnoughData, match="one block"):
        block_covariance([J], [np.ones_like(r)])
    with pytest.raises(ShapeError):
        block_covariance([J], [r[:3]])


def test_many_parameters_do_not_make_intervals_short():
    hits, rng = [], np.random.default_rng(1)
    for _ in range(20):
        A, y = rng.normal(size=(360, 120)), rng.normal(size=360)
        theta = np.linalg.lstsq(A, y, rcond=None)[0]
        found = block_covariance([A[:, None]], [(y - A @ theta)[:, None]])
        hits.append(np.abs(theta) < 1.96 * np.sqrt(np.diag(found.covariance)))
    assert 0.93 < np.mean(hits) < 0.97  # a third of the residuals' variance went into the parameters: 0.89 without


def test_few_blocks_widen_as_students_table_says():
    equal, one_counts = np.ones((30, 1)), np.array([[1.0], [0.0]])
    np.testing.assert_allclose(widening(np.hstack([equal, 2.0 * equal])), 2.0423 / 1.95996, rtol=1e-4)
    np.testing.assert_allclose(widening(one_counts), 12.7062 / 1.95996, rtol=1e-4)


def test_so_many_deviations_hold_95_percent_of_others_of_which_few_are_large():
    """Links that stop elsewhere in their gap in one dwell of ten: 1.96 rms hold too few of them."""

    rng = np.random.default_rng(1)

    def drawn(n, m):
        return np.where(rng.uniform(size=(n, m)) < 0.1, rng.uniform(-1.0, 1.0, (n, m)), rng.normal(0.0, 0.03, (n, m)))

    some, others = drawn(40, 4000), drawn(2000, 1)
    inside = [(np.abs(others) < 1.96 * s).mean() for s in (covering_sigma(some), np.sqrt((some**2).mean(axis=0)))]
    assert inside[0] > 0.95 > 0.942 > inside[1]
    gauss = np.random.default_rng(2).normal(size=(40, 4000))
    assert covering_sigma(gauss).mean() == pytest.approx(1.0, abs=0.12)


def test_without_errors_nothing_is_to_be_held():
    np.testing.assert_array_equal(covering_sigma(np.zeros((0, 3))), np.zeros(3))
