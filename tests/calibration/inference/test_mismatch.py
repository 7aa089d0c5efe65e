"""Effects that a model leaves out: seen where there are any, and by their names; nothing in, nothing out."""

import numpy as np
import pytest

from calibration.inference.family import LEVEL, Shown, holm
from calibration.inference.map_estimate import Fit
from calibration.inference.marginal_likelihood import Hyperparameters
from calibration.inference.mismatch import Effect, mismatch
from calibration.inference.parameters import ParameterSet
from calibration.inference.residual import Linearised, Noise

ROWS, D, P = 60, 3, 4
RNG = np.random.default_rng(0)
J = RNG.normal(size=(ROWS, D, P))
EFFECTS = tuple(Effect(name, RNG.normal(size=(ROWS, D, 3))) for name in ("load", "time", "posture"))
PARAMETERS = ParameterSet(tuple("abcd"), ("m",) * P, np.zeros(P), np.full(P, np.inf))
NONE = Noise(("markers",), np.zeros(D, dtype=int), np.ones(1), np.ones(1), np.zeros(1, bool), np.ones(1, bool))
BLOCK = np.repeat(np.arange(20), 3)


def shown_in(y: np.ndarray, block: np.ndarray = BLOCK) -> dict[str, Shown]:
    """Of a fit to y (ROWS, D)."""
    A, eye = J.reshape(-1, P), np.broadcast_to(np.eye(D), (ROWS, D, D))
    theta = np.linalg.lstsq(A, y.ravel(), rcond=None)[0]
    at = Linearised(theta, (A @ theta - y.ravel()).reshape(ROWS, D), J, eye)
    fit = Fit(at, NONE, Hyperparameters(np.ones(1), np.ones(0)), np.linalg.inv(A.T @ A), eye, True)
    return {t.name: t for t in mismatch(fit, PARAMETERS, EFFECTS, block)}


def noise(seed: int) -> np.ndarray:
    """Alike within a block of three rows, for the most part."""
    rng = np.random.default_rng(seed)
    return np.repeat(rng.normal(size=(20, D)), 3, axis=0) + 0.5 * rng.normal(size=(ROWS, D))


def test_nothing_in_nothing_out_though_the_residuals_of_a_block_hang_together():
    found = [any(t.seen for t in shown_in(noise(seed)).values()) for seed in range(40)]
    assert sum(found) <= 3  # 99.7 % of the binomial law of 1 %


def test_an_effect_is_seen_by_its_name_and_size_and_not_under_shuffled_labels():
    size, shuffled = np.array([1.0, -1.0, 1.0]), np.random.default_rng(1).permutation(ROWS)
    for seed in range(5):
        moved = EFFECTS[0].N @ size
        found = shown_in(noise(seed) + moved)
        assert [name for name, t in found.items() if t.seen] == ["load"]
        assert found["load"].size == pytest.approx(np.sqrt((moved**2).sum(axis=1).mean()), rel=0.35)
        assert not any(t.seen for t in shown_in(noise(seed) + moved[shuffled]).values())


def test_chance_is_as_rare_as_its_p_where_the_parameters_absorb_a_third_of_the_errors():
    p = []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        rows, few = rng.normal(size=(20, D, 18)), (Effect("time", rng.normal(size=(20, D, 2))),)
        A, eye, y = rows.reshape(-1, 18), np.broadcast_to(np.eye(D), (20, D, D)), rng.normal(size=60)
        at = Linearised(np.zeros(18), (A @ np.linalg.lstsq(A, y, rcond=None)[0] - y).reshape(20, D), rows, eye)
        fit = Fit(at, NONE, Hyperparameters(np.ones(1), np.ones(0)), np.linalg.inv(A.T @ A), eye, True)
        free = ParameterSet(tuple(map(str, range(18))), ("m",) * 18, np.zeros(18), np.full(18, np.inf))
        p.append(mismatch(fit, free, few, np.arange(20))[0].p)
    assert 2 <= sum(x < 0.05 for x in p) <= 15  # 99 % of the binomial law of 5 %


def test_an_effect_the_parameters_absorb_or_few_blocks_show_is_not_excited():
    absorbed = (Effect("gauge", J[:, :, :2]),)
    A, eye = J.reshape(-1, P), np.broadcast_to(np.eye(D), (ROWS, D, D))
    at = Linearised(np.zeros(P), noise(0), J, eye)
    fit = Fit(at, NONE, Hyperparameters(np.ones(1), np.ones(0)), np.linalg.inv(A.T @ A), eye, True)
    assert np.isnan(mismatch(fit, PARAMETERS, absorbed, BLOCK)[0].p)
    assert all(np.isnan(t.p) and not t.seen for t in shown_in(noise(0), np.repeat([0, 1, 2], 20)).values())


def test_the_family_is_at_its_level_by_holm():
    tests = [Shown(name, p) for name, p in (("a", 0.4 * LEVEL), ("b", 0.3 * LEVEL), ("c", 0.9 * LEVEL), ("d", np.nan))]
    assert [t.seen for t in holm(tests)] == [True, True, True, False]
    assert [t.seen for t in holm([Shown("a", 0.6 * LEVEL), Shown("b", 0.7 * LEVEL)])] == [False, False]
