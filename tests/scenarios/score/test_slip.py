"""The score of the slipping base alone: the hand's error where the base's yaw is wrong, and what its band claims."""

from types import SimpleNamespace

import numpy as np
import pytest

from calibration.numerics.lie import exp6
from calibration.prediction.predicted_trial import BaseMotion, PredictedTrial
from calibration.stages.stick_slip import BasePrediction, SlippingMotion
from scenarios.score.slip import slip_scores

N, REACH, YAW = 400, 0.8, 1e-3
T = np.arange(N) / 100.0
AFTER = T > 1.0


def turned(yaw):
    return exp6(np.column_stack([np.zeros((N, 5)), yaw]))


def scored(predicted, true, sigma, kind="swing", dwells=()):
    """One trial of a base that turns by `true` (n,), predicted `predicted` (n,), the hand straight ahead of it."""
    hand = np.eye(4)
    hand[0, 3] = REACH
    base = turned(true)
    truth = SimpleNamespace(t_mocap=T, base_pose=base, hand_pose=base @ hand)
    variance = np.full((N, 6), 1e-10)
    variance[:, 5] = sigma**2
    use = np.zeros((N, 2))
    use[200:220] = use[300:320] = 1.0
    motion = SlippingMotion(np.zeros((N, 6)), variance, np.zeros(N), use, ("left", "right"))
    found = BasePrediction(turned(predicted), motion)
    motions = BaseMotion(np.zeros((N, 6)), (), slipped=(("plate", found),))
    trial = PredictedTrial("a", kind, T, base=motions, dwells=np.array(dwells).reshape(-1, 2))
    (one,) = slip_scores([(trial, truth)])
    return one.entry()


@pytest.mark.parametrize(("sigma", "inside"), [(0.4e-3, 2 / 3), (0.6e-3, 1.0)])
def test_the_hand_is_off_by_the_error_of_yaw_at_its_reach(sigma, inside):
    true = np.where(AFTER, 4.0 * YAW * np.sin(2.0 * np.pi * T), 0.0)
    found = scored(true + YAW * AFTER, true, sigma)
    assert found["hand_mm"] == pytest.approx(1e3 * REACH * YAW / np.sqrt(3.0), rel=1e-3)
    assert found["still_mm"] == pytest.approx(1e3 * REACH * 4.0 * YAW / np.sqrt(6.0), rel=2e-2)
    assert found["yaw_r2"] == pytest.approx(1.0 - 1.0 / 8.0, abs=1e-2)
    assert found["inside_95"] == pytest.approx(inside, abs=0.05)


def test_errors_are_grouped_by_the_slips_since_the_first_second():
    true = np.where(AFTER, YAW, 0.0)
    found = scored(np.where(T > 3.0, 2.0, 1.0) * true, true, 1e-3)["by_slips"]
    assert [(one["slips_from"], one["n"]) for one in found] == [(0, N - 101)]
    assert found[0]["hand_mm"] > 0.0


def test_a_static_trial_counts_the_means_of_its_postures():
    true = np.where(AFTER, YAW, 0.0)
    found = scored(0.5 * true, true, 1e-3, "static", [[1.5, 2.0], [2.5, 3.0]])
    assert found["n"] == 2 and found["still_mm"] == pytest.approx(2.0 * found["hand_mm"], rel=1e-6)
