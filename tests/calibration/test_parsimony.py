"""Sizes of random errors that are noise's own are dropped, those that are there stay."""

import numpy as np

from calibration.evidence import Noise, Widths, refined
from calibration.linearised import Linearised, Prior
from calibration.parsimony import without_needless

N, FLOOR = 60, 1e-4


def problem(seed, sizes):
    """Two parameters, residuals of two components, three noises of these sizes beside a known one of a tenth."""
    rng = np.random.default_rng(seed)
    B, J = rng.normal(size=(N, 2, 3)), rng.normal(size=(N, 2, 2))
    r = 0.1 * rng.normal(size=(N, 2)) + np.einsum("nij,j,nj->ni", B, sizes, rng.normal(size=(N, 3)))
    everything = np.concatenate([B, np.broadcast_to(np.eye(2), (N, 2, 2))], axis=2)
    floor, free = np.array([FLOOR, FLOOR, FLOOR, 0.1]), np.array([True, True, True, False])
    noise = Noise(everything, np.array([0, 1, 2, 3, 3]), floor, free, np.ones(N))
    prior = Prior(np.zeros(2), np.full(2, np.inf), np.full(2, -1))
    at = Linearised(np.zeros(2), r, J, np.zeros((N, 2, 0)))
    return at, noise, prior, refined(at, noise, prior, Widths(np.array([0.1, 0.1, 0.1, 0.1]), np.zeros(0)), 1e-3)


def test_errors_that_are_there_stay_and_others_go():
    kept = []
    for seed in range(40):
        at, noise, prior, widths = problem(seed, np.array([0.3, 0.0, 0.15]))
        held, fewer = without_needless(at, noise, prior, widths)
        kept.append(fewer.noise[:3] > 1.01 * FLOOR)
        np.testing.assert_array_equal(held.free[:3] | ~kept[-1], True)
    share = np.mean(kept, axis=0)
    assert share[0] == share[2] == 1.0
    assert share[1] < 0.1
    before = np.mean([problem(seed, np.array([0.3, 0.0, 0.15]))[3].noise[1] > 1.01 * FLOOR for seed in range(40)])
    assert before > 0.25  # without it, noise of its own makes a size positive


def test_nothing_changes_where_all_are_needed():
    at, noise, prior, widths = problem(0, np.array([0.3, 0.2, 0.15]))
    held, fewer = without_needless(at, noise, prior, widths)
    assert held is noise and fewer is widths
