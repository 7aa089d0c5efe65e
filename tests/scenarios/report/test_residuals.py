"""What a report says of residuals, of absorption and of drive trains."""

from dataclasses import replace

import numpy as np
import pytest

from calibration import load_estimate, save_estimate
from calibration.inference.absorption import Absorption
from calibration.verdict import Verdict
from scenarios.report import write
from scenarios.report.results.traces import Trace
from scenarios.report.sections.joints import Loop, drawn
from scenarios.report.sections.residuals import left
from tests.doubles.html_page import Page
from tests.doubles.run_folder import write_estimate, write_evaluation

STEP = 0.01  # [s]


def trace(e, kind="swing"):
    t = STEP * np.arange(len(e))
    return Trace("model_2", "plate", "motor", "xyz", kind, t, e, e[:, 0], e, e[:, 0])


def remembering(n, a, seed=0):
    """x_k = a x_{k-1} + w_k, (n, 3): correlation time dt (1 + a) / (1 - a)."""
    w, x = np.random.default_rng(seed).normal(size=(n, 3)), np.zeros((n, 3))
    for k in range(1, n):
        x[k] = a * x[k - 1] + w[k]
    return x


def test_bias_memory_and_tails_of_residuals_are_those_of_the_series():
    found = left(trace(remembering(20000, 0.9) + [3.0, 0.0, -1.0]))
    np.testing.assert_allclose(found.bias, [3.0, 0.0, -1.0], atol=0.2)
    assert found.time == pytest.approx(STEP * 1.9 / 0.1, rel=0.15)
    assert found.independent == pytest.approx(20000 * 0.1 / 1.9, rel=0.15)
    assert found.tail == pytest.approx(0.27, abs=0.15)
    assert found.constant == pytest.approx(100 * (10.0 / 3.0) / found.rmse**2, rel=0.1)
    assert left(trace(remembering(5000, 0.0))).time == pytest.approx(STEP, rel=0.3)


def test_postures_have_no_correlation_time():
    found = left(trace(remembering(30, 0.0), kind="static"))
    assert (found.time, found.independent) == (None, 30)


def test_absorption_is_a_section_with_what_is_hidden_first(tmp_path, undrawn):
    write_evaluation(tmp_path)
    write_estimate(tmp_path / "estimate", Verdict("clocks", "ok", "fine"))
    whole = load_estimate(tmp_path / "estimate")
    share = np.array([[0.0, 0.21, 0.21], [0.62, 0.0, 0.62], [0.11, 0.97, 0.98]])
    found = Absorption(("placements", "zeros", "wobble"), ("placements", "zeros", "all others"), share)
    models = tuple(replace(m, absorption=found) for m in whole.models)
    save_estimate(replace(whole, models=models), tmp_path / "again")
    (tmp_path / "estimate" / "estimate.json").write_bytes((tmp_path / "again" / "estimate.json").read_bytes())
    write(tmp_path)
    text = Page(tmp_path / "report.html").text
    assert text.index("wobble (joint axes that wobble): 98 % absorbed, most of it by zeros.") < text.index(
        "zeros: 62 % absorbed"
    )
    assert "placements: 21 % absorbed" not in text
    assert "#absorption" in Page(tmp_path / "report.html").links


def test_without_absorption_there_is_no_section(tmp_path, undrawn):
    write_evaluation(tmp_path)
    write_estimate(tmp_path / "estimate", Verdict("clocks", "ok", "fine"))
    write(tmp_path)
    assert "#absorption" not in Page(tmp_path / "report.html").links


def test_a_joint_with_a_drive_train_is_shown_with_it_and_both_flanks():
    t = np.linspace(0.0, 6.0, 200)
    v, train, printed = np.cos(t), np.sign(np.cos(t)), 0.5 * np.sign(np.cos(t))
    one = Loop("arm_1_joint", True, t, np.sin(t), v, train + 0.1, printed, train, 0 * t - 1.0, 0 * t + 1.0)
    assert (one.model is one.train, one.gap) == (True, 2.0)
    assert one.after == pytest.approx(0.1)
    assert one.after_printed > 0.4
    ax = drawn([one]).axes[0]
    assert [line.get_label() for line in ax.lines].count("flanks of the gap") == 2
    assert "→ 0.10 mrad" in ax.get_title(loc="left")
    bare = replace(one, train=np.nan * t, low=np.nan * t, high=np.nan * t)
    assert bare.model is bare.printed
    assert "flanks of the gap" not in [line.get_label() for line in drawn([bare]).axes[0].lines]
