"""What link encoders show of drive trains in use: shares of open intervals, in motion and at rest."""

from dataclasses import dataclass

import numpy as np
import pytest

import mjcf
from calibration.stages.drive_trains.corrected_trial import CorrectedTrial
from calibration.stages.drive_trains.drive_train import DriveTrain, harmonic_terms
from calibration.stages.drive_trains.drive_trains import DriveTrains, LinkAngles
from calibration.stages.drive_trains.errors_in_use import doubt, with_doubts
from calibration.stages.drive_trains.torques import dynamics
from tests.doubles import rigid_robot
from tests.doubles.rigid_robot import Readings

JOINT, OTHER, COLUMN, GAP, LEFT = "arm_3_joint", "arm_5_joint", 3, 2e-3, 3e-5
ERRORS = np.array([2e-3, 1.5e-3, -1e-3, 3e-4, 2e-4])
STRETCH, STRETCHES = 80, 80  # samples of one, and how many in a trial
N, WINDOW = STRETCH * STRETCHES, 10


@dataclass(frozen=True)
class Loads:
    """Times and velocities of a trial."""

    t: np.ndarray
    v: np.ndarray


def corrected(seed: int, moving: float, resting: float) -> CorrectedTrial:
    """A trial in which intervals open off and on, their errors by a share of them: moving, resting.

    A rest before the first motion has the interval of an unknown start. Of every tenth window there is no link reading.
    """
    rng, shape, part = np.random.default_rng(seed), (N, 8), np.arange(N) // STRETCH
    theta, v = rng.uniform(-1.0, 1.0, shape), np.where((part % 4 < 2) & (part > 0), 0.3, 0.0)[:, None] * np.ones(8)
    width = np.repeat(np.where(np.arange(STRETCHES) % 2, 0.0, rng.uniform(0.5, 2.0, STRETCHES)) * GAP, STRETCH)[:, None]
    share = np.where(part == 0, 0.0, np.where(part % 4 < 2, moving, resting))[:, None]
    signs = np.repeat(rng.choice([-1.0, 1.0], (N // WINDOW, 8)), WINDOW, axis=0)
    error = np.hypot(LEFT, share * width / np.sqrt(12.0)) * signs
    predicted, read = theta + error, np.full(shape, np.nan)
    read[:, COLUMN] = theta[:, COLUMN] + ERRORS[0] + harmonic_terms(theta[:, COLUMN]) @ ERRORS[1:]
    read[np.arange(N) // WINDOW % 10 == 0] = np.nan
    angles = LinkAngles(predicted, predicted - 0.5 * width, predicted + 0.5 * width, np.zeros(shape), None)
    return CorrectedTrial(Readings(predicted, read), Loads(0.01 * np.arange(N), v), angles)  # type: ignore[arg-type]


def trains() -> DriveTrains:
    values, described = np.array([GAP, 1e-4, 0.1, 0.1, 0.0, 0.0, 0.0]), rigid_robot.described()
    one = DriveTrain(JOINT, "dead_zone", values, link=ERRORS, residual=LEFT)
    other = DriveTrain(OTHER, "dead_zone", values, residual=LEFT, doubt=1.7, doubt_at_rest=1.6)
    return DriveTrains(dynamics(mjcf.urdf(), described, np.zeros(8)), (one, other), mjcf.urdf(), described)


@pytest.mark.parametrize(("moving", "resting"), [(0.3, 1.5), (0.9, 1.1), (2.0, 2.5)])
def test_an_open_interval_is_as_uncertain_as_links_in_it_were(moving: float, resting: float) -> None:
    one, other = with_doubts(trains(), [corrected(0, moving, resting), corrected(1, moving, resting)]).trains
    assert one.doubt == pytest.approx(moving, rel=0.03, abs=0.06)
    assert one.doubt_at_rest == pytest.approx(resting, rel=0.03, abs=0.06)
    assert (other.doubt, other.doubt_at_rest) == (1.7, 1.6)


def test_at_rest_an_interval_is_no_surer_than_an_even_distribution() -> None:
    assert with_doubts(trains(), [corrected(2, 0.5, 0.2)]).trains[0].doubt_at_rest == 1.0


def test_trials_without_readings_say_nothing() -> None:
    silent = CorrectedTrial(Readings(np.zeros((0, 8)), np.zeros((0, 8))), Loads(np.zeros(0), np.zeros((0, 8))), None)  # type: ignore[arg-type]
    alone = with_doubts(trains(), [silent])
    assert [train.doubt for train in alone.trains] == [train.doubt for train in trains().trains]
    one = corrected(3, 0.5, 1.2)
    assert with_doubts(trains(), [silent, one]).trains[0].doubt == with_doubts(trains(), [one]).trains[0].doubt


def test_few_stretches_say_little_and_many_much() -> None:
    even, rows = np.ones(400), np.zeros(400, dtype=bool)
    assert doubt(np.zeros(400), even, rows) == 1.0
    rows[:200] = True
    assert doubt(np.zeros(400), even, rows) == pytest.approx(np.sqrt(2.0 / 3.0))  # one of them, however long
    rows[:] = np.arange(400) % 4 == 0
    assert doubt(np.full(400, 0.25), even, rows) == pytest.approx(0.5, abs=0.02)
    assert doubt(np.full(400, -1.0), even, rows) == pytest.approx(np.sqrt(2.0 / 102.0))
    assert doubt(np.full(400, 100.0), even, rows) == pytest.approx(np.sqrt(12.0))
