import numpy as np
import pytest

from calibration.numerics.signals import RATE, Signal
from calibration.numerics.time_delay import Pair
from calibration.stages.clocks.plate_moments import plate_axes

LAGS = (2.61, 2.63, 2.58)  # [s]


def turn(degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s], [s, c]])


def recorded(Q, rng):
    """Trials of swings: moments in the lab, and what a plate whose axes are turned by Q reads of them, later."""
    found = []
    for lag in LAGS:
        t = np.arange(int(20.0 * RATE)) / RATE
        y = np.stack([(a * np.sin(2.0 * np.pi * f * t + 1.0)) for a, f in ((12.0, 0.37), (8.0, 0.52))], axis=1)
        y = y * np.clip(np.minimum(t - 1.0, 19.0 - t), 0.0, 1.0)[:, None]
        x = (y + [4.0, -60.0]) @ Q + 0.5 * rng.normal(size=y.shape)
        ok = np.ones(len(t), dtype=bool)
        nothing = np.zeros((len(t), 0, 2))
        found.append(Pair(Signal(t, y, ok), Signal(t - lag, x, ok), nothing, nothing))
    return found


@pytest.mark.parametrize(
    "Q",
    [-np.eye(2), turn(90.0), turn(-35.0), np.diag([-1.0, 1.0]), np.diag([1.0, -1.0])],
    ids=["half a turn", "a quarter", "35 deg", "Mx", "My"],
)
def test_a_plate_that_is_turned_or_mirrored_is_turned_back(Q):
    pairs = recorded(Q, np.random.default_rng(0))
    found = plate_axes(pairs)
    np.testing.assert_allclose(found, Q, atol=0.02)
    turned = pairs[0].turned(found)
    np.testing.assert_allclose(turned.x.x.mean(axis=0), [4.0, -60.0], atol=1.5)
    assert turned.y is pairs[0].y


@pytest.mark.parametrize("degrees", [0.0, 12.0])
def test_a_plate_that_is_right_or_nearly_is_left_alone(degrees):
    np.testing.assert_array_equal(plate_axes(recorded(turn(degrees), np.random.default_rng(1))), np.eye(2))
