"""Motor and link readings that are exchanged are named by the motor's velocity; what gears and encoders do is not."""

from types import SimpleNamespace

import numpy as np
import pytest

from calibration.checks.joint_readings import exchanged

SIGMA, T = 1.5e-5, np.arange(0.0, 20.0, 0.01)
MOTOR = np.sin(T)
LAG = 0.5e-3 * np.tanh(20.0 * np.cos(T))  # the link behind backlash of 1 mrad
RNG = np.random.default_rng(0)


def _trial(motor: np.ndarray, link: np.ndarray, velocity: np.ndarray) -> SimpleNamespace:
    columns = {"q_motor": motor, "q_link": link, "v_motor": velocity + 1e-4 * RNG.normal(size=len(T))}
    return SimpleNamespace(joint=("arm_1_joint",), t_robot=T, **{k: x[:, None] for k, x in columns.items()})


@pytest.mark.parametrize(
    ("motor", "link", "named"),
    [
        (MOTOR, MOTOR - LAG, False),
        (MOTOR - LAG, MOTOR, True),
        (1.03 * MOTOR, MOTOR - LAG, False),  # a gain, which is named as such
        (np.radians(np.round(np.degrees(MOTOR))), MOTOR - LAG, False),  # steps of a degree
        (MOTOR, MOTOR, False),
        (MOTOR, np.nan * MOTOR, False),
        (0.0 * MOTOR, MOTOR - LAG, False),
    ],
)
def test_exchanged_sides_are_named_and_nothing_else(motor, link, named):
    found = list(exchanged(_trial(motor, link, np.cos(T)), SIGMA))
    assert bool(found) == named and all("arm_1_joint are exchanged" in message for message in found)


def test_velocities_nobody_recorded_name_nothing():
    assert not list(exchanged(_trial(MOTOR - LAG, MOTOR, 0.0 * T), SIGMA))
    assert not list(exchanged(_trial(MOTOR - LAG, MOTOR, np.nan * T), SIGMA))


def test_a_velocity_that_jumps_between_samples_is_off_both_sides_and_names_nothing():
    """Its integral is off the motor in six moments, where the link happens to be as far off; elsewhere it is not."""
    moments, width = len(T) // 10, 10
    jumps = np.zeros(moments)
    jumps[20:140:20] = 2e-4 * (-1.0) ** np.arange(6)
    wander = np.where(jumps == 0.0, RNG.uniform(-1.2e-4, 1.2e-4, moments), 0.0)
    off, apart = (
        np.interp(np.arange(len(T)), width * np.arange(1, moments + 1), np.cumsum(x)) for x in (jumps, wander)
    )
    trial = _trial(MOTOR, MOTOR + off + apart, np.cos(T) + np.gradient(off, T))
    assert not list(exchanged(trial, SIGMA))
    assert list(exchanged(_trial(MOTOR, MOTOR + off, np.cos(T) + np.gradient(off, T)), SIGMA))
