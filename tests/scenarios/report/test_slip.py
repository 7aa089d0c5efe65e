"""The section of the slipping base: what it counts, and that what a trial's file holds is what was predicted."""

from dataclasses import replace

import numpy as np

from calibration.evaluation.evaluate import not_predictable
from calibration.prediction import BaseMotion, PredictedTrial, read_predicted
from calibration.stages.stick_slip import SlippingMotion
from scenarios.report.sections.slip import Slipped, line

T = np.arange(400) / 100.0


def motion():
    x = np.zeros((400, 6))
    x[101:, 5] = 2e-3
    use = np.zeros((400, 2))
    use[150:250, 1] = 1.0
    return SlippingMotion(x, np.full((400, 6), 1e-8), np.sin(T), use, ("left", "right"))


def test_errors_band_and_sliding_are_counted_after_the_first_second():
    measured = motion().x.copy()
    measured[:101] = 1.0
    measured[250:, 5] += 1e-3
    found = line(Slipped("a", T, measured, motion()))
    np.testing.assert_allclose(found.left, [0.0, 0.0, np.sqrt(150 / 299)], rtol=1e-6)
    np.testing.assert_allclose(found.inside, [100.0, 100.0, 100.0 * 149 / 299])
    np.testing.assert_allclose(found.slides, 100.0 * 100 / 299)


def test_a_trial_is_read_as_it_was_saved(tmp_path):
    trial = PredictedTrial("a", "swing", T, base=BaseMotion(motion().x, (), None, motion()))
    trial.save(tmp_path)
    found = read_predicted(tmp_path / "a.nc").base.slipping
    assert found.wheels == ("left", "right")
    for name in ("x", "variance", "moment", "use"):
        np.testing.assert_allclose(getattr(found, name), getattr(motion(), name), rtol=1e-6)


def test_a_trial_whose_band_is_wider_than_its_motion_is_named():
    """And so is one whose yaw turns the other way."""
    wide = replace(motion(), variance=np.full((400, 6), 1e-5))
    trials = [PredictedTrial(name, "swing", T, base=BaseMotion(m.x, (), None, m)) for name, m in
              (("good", motion()), ("bad", wide))]  # fmt: skip
    (said,) = not_predictable(trials)
    assert said.verdict == "warning" and "bad (3.2 mrad)" in said.message and "good" not in said.message
    against = PredictedTrial("against", "swing", T, base=BaseMotion(-motion().x, (), None, motion()))
    (said,) = not_predictable([trials[0], against])
    assert said.verdict == "warning" and "in against:" in said.message
