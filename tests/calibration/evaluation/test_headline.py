"""One headline: the row that is delivered, its base from the best instrument that was recorded."""

import numpy as np
import pytest

from calibration.evaluation import TrialErrors, headline, ladder
from calibration.evaluation.pose_errors import PoseErrors


def rows(*named, kind="swing"):
    errors = PoseErrors(np.full((50, 3), 1e-3), np.zeros((50, 3)))
    t = np.arange(50.0)
    return list(
        ladder([TrialErrors(model, base, encoder, "a", kind, t, errors, errors) for model, base, encoder in named], "")
    )


ALL = [(m, b, "motor") for m in ("model_2", "full") for b in ("fixed", "dynamics", "plate", "measured")]


@pytest.mark.parametrize(
    ("missing", "base"),
    [((), "plate"), (("plate",), "dynamics"), (("plate", "dynamics"), "fixed"), (("plate", "dynamics", "fixed"), None)],
)
def test_the_base_comes_from_the_best_source_recorded_and_is_measured_only_as_a_last_resort(missing, base):
    found = headline(rows(*[one for one in ALL if one[1] not in missing], ("full", "plate", "link")), "full")
    assert (found.main.model, found.main.base, found.main.encoder) == ("full", base or "measured", "motor")
    assert [(r.model, r.base) for r in found.beside] == [("model_2", base or "measured")]


def test_moving_trials_come_before_static_ones():
    static = rows(*ALL, kind="static")
    assert headline(static, "full").main.trials == "static"
    assert headline([*static, *rows(*ALL)], "full").main.trials == "dynamic"
    assert headline(static, "mine") is None
