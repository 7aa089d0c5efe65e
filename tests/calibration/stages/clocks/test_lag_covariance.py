"""Lag and drift with nuisances that follow every move: values by least squares, variances of the right size."""

from dataclasses import replace

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from calibration.stages.clocks import lag_covariance
from calibration.stages.clocks.lag_covariance import lag_and_drift, without_nuisances

MOVES, PER_MOVE, DT = 8, 4, 0.625
ROWS = 6 * PER_MOVE


def design(rng):
    """Moves of unlike size, half of all rows' freedom taken by nuisances that the moves share."""
    t = DT * np.arange(MOVES * PER_MOVE)
    slope = (np.repeat(rng.uniform(0.2, 1.0, MOVES), ROWS)) * rng.normal(size=MOVES * ROWS)
    S = np.column_stack([slope, slope * np.repeat(t - t.mean(), 6)])
    return rng.normal(size=(len(S), len(S) // 2)), rng.normal(size=(len(slope), 5)), S, t


def reduced(rng):
    A, B, S, t = design(rng)
    return without_nuisances(A, B, np.zeros(len(S)), S, t)


def mean_covariance(x, rng, draws=200):
    """Of as many draws of white noise on the same design, and how often 1.96 sigmas hold the truth."""
    C, z, U = np.zeros((2, 2)), [], np.linalg.qr(x.V[:, :-2])[0]  # of the nuisances
    for _ in range(draws):
        noise = rng.normal(size=len(x.r))
        found, one = lag_and_drift(replace(x, r=noise - U @ (U.T @ noise)))
        C, z = C + one / draws, [*z, found / np.sqrt(np.diag(one))]
    return C, (np.abs(z) <= 1.96).mean(axis=0)


def test_variances_are_those_of_white_noise_widened_by_student_s_quantile():
    rng = np.random.default_rng(0)
    x = reduced(rng)
    true = np.linalg.inv(x.S.T @ x.S)
    v = ((x.S @ true)[: MOVES * ROWS] ** 2).reshape(MOVES, ROWS, 2).sum(axis=1)
    wider = student.ppf(0.975, v.sum(axis=0) ** 2 / (v**2).sum(axis=0)) / norm.ppf(0.975)
    C, held = mean_covariance(x, rng)
    np.testing.assert_allclose(np.diag(C), wider**2 * np.diag(true), rtol=0.1)
    assert (held > 0.91).all()


def test_residuals_as_they_are_would_say_half_of_it(monkeypatch):
    rng = np.random.default_rng(0)
    x = reduced(rng)
    given, _ = mean_covariance(x, rng, 50)
    monkeypatch.setattr(lag_covariance, "_given_back", lambda x, e: e)
    taken, _ = mean_covariance(x, rng, 50)
    assert (np.diag(taken) < 0.65 * np.diag(given)).all()


def test_values_are_those_of_least_squares_with_all_columns_at_once():
    rng = np.random.default_rng(0)
    A, B, S, t = design(rng)
    r = rng.normal(size=len(S))
    x = without_nuisances(A, B, r, S, t)
    found, _ = lag_and_drift(x)
    rows = np.block([[S, A, B], [np.zeros((5, 2 + A.shape[1])), np.eye(5)]])
    everything = np.linalg.lstsq(rows, np.concatenate([r, np.zeros(5)]), rcond=None)[0]
    np.testing.assert_allclose(found, everything[:2], rtol=1e-8)
    np.testing.assert_allclose(x.coefficients(found), everything[-5:], rtol=1e-6)
    known = np.linalg.lstsq(rows[:, [0, *range(2, rows.shape[1])]], np.concatenate([r, np.zeros(5)]), rcond=None)[0]
    assert np.isclose(x.taken_for(r), known[0], rtol=1e-8)  # drift known to be none


def test_a_block_that_nuisances_explain_whatever_it_was_says_nothing():
    rng = np.random.default_rng(1)
    A, B, S, t = design(rng)
    r = rng.normal(size=len(S))
    whole = np.eye(len(S))[:, :ROWS]
    found, C = lag_and_drift(without_nuisances(np.column_stack([A, whole]), B, r, S, t))
    again, same = lag_and_drift(
        without_nuisances(np.column_stack([A, whole]), B, np.r_[9.0 + r[:ROWS], r[ROWS:]], S, t)
    )
    np.testing.assert_allclose(again, found, rtol=1e-6)
    np.testing.assert_allclose(same, C, rtol=1e-6)
    assert (np.linalg.eigvalsh(C) > 0.0).all()
