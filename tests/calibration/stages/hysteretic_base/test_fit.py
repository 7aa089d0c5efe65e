"""A base whose yaw sticks and slips, whose tilt is linear, and whose x follows: 15 s under known wrenches."""

import numpy as np
import pytest

from calibration.errors import NotEnoughData
from calibration.numerics.signals import RATE
from calibration.stages.hysteretic_base import BaseLog, fit_base, left_out_cycles, score
from calibration.stages.hysteretic_base.log import compared
from calibration.stages.hysteretic_base.yaw import SlippingYaw

YAW = SlippingYaw(350.0, np.array([1200.0]), np.array([8e-3]), 30.0, np.array([0.05, 0.0]))
NOISE = 1e-5


@pytest.fixture(scope="module")
def log():
    rng = np.random.default_rng(0)
    t = np.arange(1500) / RATE
    jerk = np.exp(-(((t - 3.0) / 0.1) ** 2)) * np.array([[10.0, -20.0, 3.0, 30.0, 12.0, -30.0]]).T
    cycle = (t > 3.0) * np.sin(1.3 * (t - 3.0) + np.arange(6)[:, None]) * np.array([[5, 8, 3, 25, 15, 9.0]]).T
    w = (jerk + cycle).T
    x = np.zeros((len(t), 6))
    x[:, 3:5] = compared(w)[:, 3:5] / 2e4
    x[:, 5] = compared(YAW.predicted(w)[:, None])[:, 0]
    x[:, 0] = x[:, 3:] @ [0.2, 0.4, 0.03]
    return BaseLog(t, w, x + NOISE * rng.normal(size=x.shape))


@pytest.fixture(scope="module")
def base(log):
    return fit_base(log, log.t < 10.0)


def test_each_axis_gets_the_form_it_has(base):
    assert base.forms[0] in ("follows", "linear")
    assert base.forms[5].startswith("slip")
    assert base.forms[3] != "still"


def test_the_rest_of_the_log_is_predicted(base, log):
    found = score(base, log, log.t >= 10.0)
    assert found.hand < 0.1 * found.still
    assert found.yaw_r2 > 0.98
    assert found.hand < 2e-4


def test_its_stiffness_is_found(base):
    yaw = base.axes[5]
    total = YAW.spring + YAW.elements[0]
    assert yaw.spring + yaw.elements.sum() == pytest.approx(total, rel=0.1)


def test_cycles_left_out_are_predicted(base, log):
    assert left_out_cycles(base, log, 5.0, 5.0).hand < 2e-4
    with pytest.raises(NotEnoughData, match="fewer than two cycles"):
        left_out_cycles(base, log, 11.0, 5.0)


def test_a_log_that_hardly_moves_is_not_fitted(log):
    with pytest.raises(NotEnoughData, match="moves for less than 4 s"):
        fit_base(log, log.t < 4.0)


def test_noise_alone_leaves_the_base_still(log):
    rng = np.random.default_rng(1)
    n = 1100
    still = BaseLog(log.t[:n], log.w[:n], NOISE * compared(rng.normal(size=(n, 6))))
    found = fit_base(still, still.t < 10.0)
    rest = score(found, still, still.t >= 10.0)
    assert rest.hand < 1.1 * rest.still
