import numpy as np
import pytest

from calibration.evaluation.ladder import TrialErrors
from calibration.evaluation.pose_errors import PoseErrors
from calibration.evaluation.protocols import protocol_rows


def trace(model, base, encoder, offset, scale=1e-3):
    t = np.arange(0.0, 20.0, 0.01)
    wave = np.sin(2 * np.pi * t / 5.0)[:, None] * np.ones(3)
    errors = PoseErrors(offset + scale * wave, 0.01 * wave)
    return TrialErrors(model, base, encoder, "xyz", "swing", t, errors, errors)


def test_the_public_protocol_removes_constants_of_models_2_and_3_only():
    traces = [
        trace("nominal", "fixed", "motor", 0.0),
        trace("model_1", "measured", "motor", 5e-3),
        trace("model_2", "measured", "motor", 5e-3),
        trace("model_2", "fixed", "motor", 9.0),
        trace("model_3", "measured", "link", 5e-3),
    ]
    rows = {r.model: r for r in protocol_rows(traces, [])}
    wave = 1.0 / np.sqrt(2.0)
    assert rows["nominal"].position_rmse_component_mm == pytest.approx(wave, rel=1e-2)
    assert rows["model_1"].position_rmse_component_mm == pytest.approx(np.hypot(5.0, wave), rel=1e-2)
    assert rows["model_2"].position_rmse_component_mm == pytest.approx(wave, rel=1e-2)
    assert rows["model_3"].encoder == "link" and rows["model_3"].constants_removed
    assert 495 <= rows["nominal"].n <= 505  # 5 s


def test_a_model_that_is_not_there_has_no_row():
    assert [r.model for r in protocol_rows([trace("nominal", "fixed", "motor", 0.0)], [])] == ["nominal"]
