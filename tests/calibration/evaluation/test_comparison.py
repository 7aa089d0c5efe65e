import numpy as np
import pytest

from calibration.evaluation.comparison import compare, comparisons
from calibration.evaluation.ladder import TrialErrors
from calibration.evaluation.pose_errors import PoseErrors
from calibration.evaluation.results import no_better


def trace(model, base, error):
    t = np.arange(len(error)) * 0.01
    errors = PoseErrors(error, np.zeros_like(error))
    return TrialErrors(model, base, "motor", "xyz", "swing", t, errors, errors)


@pytest.fixture
def common():
    return 1e-3 * np.cumsum(np.random.default_rng(0).normal(size=(6000, 3)), axis=0) / 10.0


def test_a_pair_is_compared_on_the_same_blocks(common):
    worse = compare([trace("a", "fixed", common), trace("b", "plate", 1.2 * common)], ("a", "fixed"), ("b", "plate"))
    rms = 1e3 * np.sqrt((common**2).mean())
    assert worse.difference_mm == pytest.approx(0.2 * rms)
    assert worse.finding == "worse" and worse.low_mm < worse.difference_mm < worse.high_mm
    assert worse.blocks == 30


def test_equal_rows_do_not_differ(common):
    noise = 1e-4 * np.random.default_rng(1).normal(size=common.shape)
    pair = [trace("a", "fixed", common + noise), trace("b", "plate", common - noise)]
    assert compare(pair, ("a", "fixed"), ("b", "plate")).finding == "no difference"


def test_what_is_not_there_is_not_compared(common):
    assert list(comparisons([trace("nominal", "fixed", common)])) == []
    found = list(comparisons([trace("nominal", "fixed", common), trace("model_1", "plate", 0.5 * common)]))
    assert [c.b for c in found] == [("model_1", "plate")] and found[0].finding == "better"


@pytest.mark.parametrize(
    ("share", "against", "finding", "said"),
    [
        (1.0, 1.0, "better", "moved the hand by 1.00 mm rms per component, of which the prediction leaves 0.00 mm"),
        (1.0, -1.0, "worse", "even with the measured base the error is 10.00 mm instead of 9.00"),
        (-2.0, 1.0, "worse", "misses that by 3.00 mm; with the measured base the error is 10.00 mm instead of 11.00"),
    ],
)
def test_why_moving_the_base_helps_or_does_not_is_said_in_figures(share, against, finding, said):
    """The hand is 10 mm off by itself; the base moves it by 1 mm with or against that, a share of it predicted."""
    hand = 1e-2 * np.ones((6000, 3))
    base = against * 1e-3 * np.ones((6000, 3))
    rows = (("nominal", "fixed", hand + base), ("nominal", "measured", hand))
    found = list(comparisons([trace(*r) for r in (*rows, ("model_1", "plate", hand + (1.0 - share) * base))]))
    assert (found[0].finding, len(found)) == (finding, 1)
    assert said in found[0].reason
    reported = [v.message for v in no_better(found)]
    worse = f"model_1 (plate) is worse than nominal by {found[0].difference_mm:.2f} mm: {found[0].reason}"
    assert reported == ([worse] if finding == "worse" else [])
    without = list(comparisons([trace(*rows[0]), trace("model_1", "plate", hand)]))
    assert without[0].reason == ""
