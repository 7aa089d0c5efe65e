"""The error of the delivered row taken apart by its causes."""

import numpy as np
import pytest

from calibration.evaluation.budget import budget as budget_of
from calibration.evaluation.budget import causes
from calibration.numerics.lie import compose
from calibration.prediction.predicted_trial import Delivered

T = np.arange(0.0, 60.0, 0.01)
SIZE = {"base": 3e-4, "joints": 4e-4, "clocks": 2e-4, "geometry": 1e-4, "noise": 1.5e-4}


def one(size: dict[str, float], link: bool = True, lost: slice = slice(0)):
    """A trial whose hand is off by each cause, RMS per component as in `size`; instruments have errors of their own.

    Without predictions in some samples.
    """
    rng, n = np.random.default_rng(1), len(T)
    wave = np.sqrt(2.0) * np.sin(2.0 * np.pi * np.outer(T, [0.31, 0.43, 0.57]))
    place = np.array([0.5, 0.1, 0.9]) + 0.2 * np.sin(2.0 * np.pi * np.outer(T, [0.11, 0.17, 0.23]))
    v = np.gradient(place, T, axis=0)
    e = {
        "base": size["base"] * wave,
        "joints": size["joints"] * np.roll(wave, 700, axis=1) * np.array([1.0, -1.0, 1.0]),
        "clocks": size["clocks"] * v / np.sqrt((v**2).mean()),
        "geometry": size["geometry"] * np.cos(2.0 * np.pi * np.outer(T, [0.07, 0.05, 0.03])) * np.sqrt(2.0),
        "noise": -size["noise"] * rng.normal(size=(n, 3)),
    }
    still, eye = np.tile(np.eye(3), (n, 1, 1)), np.tile(np.eye(4), (n, 1, 1))
    hand = compose(still, place - e["joints"] - e["clocks"] - e["geometry"] - e["base"])
    seen = hand + 0.0
    seen[:, :3, 3] -= e["noise"]
    predicted = compose(still, place - e["base"])
    T_B = compose(still, e["base"])
    T_B[lost] = np.nan
    q_link = np.zeros((n, 3)) - e["joints"] + 2e-4 * rng.normal(size=(n, 3)) if link else np.full((n, 3), np.nan)
    without = ("base", compose(still, place + 5e-3))
    delivered = Delivered(("a", "b", "c"), T_B, predicted, np.full((n, 3), 0.3), q_link, still, (without,))
    T_seen_B = eye + 0.0
    T_seen_B[:, :3, 3] += 3e-4 * rng.normal(size=(n, 3))
    return causes(delivered, T, seen, T_seen_B, q_link, np.full(n, size["noise"] ** 2))


def test_every_cause_is_as_large_as_it_was_made_and_squares_add_up():
    found = budget_of([one(SIZE)])
    sizes = {s.cause: 1e-3 * s.size_mm for s in found.shares}
    for cause, size in SIZE.items():
        assert sizes[cause] == pytest.approx(size, abs=4e-5), cause
    assert sum(x**2 for x in sizes.values()) == pytest.approx((1e-3 * found.whole_mm) ** 2, rel=1e-9)


@pytest.mark.parametrize("cause", ["base", "joints", "clocks", "geometry"])
def test_a_cause_that_is_not_there_has_no_share(cause):
    found = budget_of([one(SIZE | {cause: 0.0})])
    assert next(s.size_mm for s in found.shares if s.cause == cause) < 0.05


def test_next_steps_are_ranked_by_what_they_gain():
    found = budget_of([one(SIZE)])
    assert [s.cause for s in found.next_steps][:2] == ["joints", "base"]
    whole = 1e3 * np.sqrt(sum(x**2 for x in SIZE.values()))
    gain = whole - np.sqrt(whole**2 - (1e3 * SIZE["joints"]) ** 2)
    assert found.next_steps[0].gain_mm == pytest.approx(gain, abs=0.05)
    assert "of the 0.5" in found.sentence.lower() and "link-side encoders" in found.sentence
    assert found.worth[0].without_mm == pytest.approx(5.0, rel=0.05)


def test_samples_beside_lost_ones_count():
    found = one(SIZE, lost=slice(3000, 3300, 30))
    whole = found.whole[np.isfinite(found.whole).all(axis=1)]
    assert len(whole) == len(found.whole) - 10
    assert budget_of([found]).whole_mm == pytest.approx(1e3 * np.sqrt((whole**2).mean()), rel=1e-12)


def test_without_link_encoders_joints_and_geometry_are_one_cause():
    shares = {s.cause: s.size_mm for s in budget_of([one(SIZE, link=False)]).shares}
    assert "joints" not in shares
    assert shares["joints and geometry"] == pytest.approx(1e3 * np.hypot(SIZE["joints"], SIZE["geometry"]), abs=0.05)


def test_nothing_compared_has_no_budget():
    assert budget_of([]) is None
