"""What a link's lateness takes off the clock: the moments of the formula, by draws; what the fit lays to winding."""

from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration.numerics.time_delay import Lag
from calibration.recording.clock import Clock
from calibration.robot.chain import chain_of
from calibration.stages.clocks.clock_fit import TrialLag, allowance, fit_clock
from calibration.stages.clocks.pose_refinement import provisional, refined, refined_lags
from calibration.stages.clocks.pose_samples import Samples
from tests.doubles import geared_robot, rigid_robot

KNOWN = rigid_robot.described().tolerances.model_copy(update={"joint_delay": 8e-5, "joint_delay_spread": 0.5})
CLOCK = Clock("robot", 3.9, 40e-6, np.zeros((2, 2)), 20.0, 1e-4)


def lag(wound: float, sigma: float = 1e-4, unseen: float = 0.0) -> TrialLag:
    return TrialLag("swing", 10.0, Lag(3.9, sigma), wound=wound, unseen=unseen)


@pytest.mark.parametrize(("wound", "unseen"), [(0.0, 0.0), (4e-4, 0.0), (2e-4, 1e-4)])
def test_mean_and_spread_are_those_of_the_formula(wound, unseen):
    rng, n = np.random.default_rng(0), 400_000
    late = 8e-5 * np.exp(0.5 * rng.normal(size=n)) + rng.uniform(0.0, 0.2, n) * wound
    late += rng.normal(1.0, 1.0, n) * unseen
    np.testing.assert_allclose(
        allowance("robot", [lag(wound, unseen=unseen)], KNOWN), (late.mean(), late.std()), rtol=0.01
    )


def test_trials_count_by_what_they_tell_of_the_clock_and_a_plate_is_not_geared():
    both = [lag(4e-4, 1e-4), lag(0.0, 2e-4)]
    np.testing.assert_allclose(allowance("robot", both, KNOWN), allowance("robot", [lag(3.2e-4)], KNOWN))
    assert allowance("plate", both, KNOWN) == (0.0, 3e-4)


def test_play_that_is_early_widens_and_does_not_shift():
    early, none = allowance("robot", [lag(-4e-4)], KNOWN), allowance("robot", [lag(0.0)], KNOWN)
    assert early[0] == none[0] and early[1] == allowance("robot", [lag(4e-4)], KNOWN)[1] > none[1]


def test_what_was_laid_to_winding_in_the_later_trials_is_not_taken_for_drift():
    rng, z = np.random.default_rng(0), []
    for _ in range(200):
        s, mislaid = np.linspace(100.0, 700.0, 9), rng.normal()
        wound = 5e-7 * s - 1e-4 + 1e-4 * rng.normal(size=9)  # sweeps come first, swings that fold last
        noise = 7e-5 * rng.normal(size=9)
        lags = [
            TrialLag("swing", at, Lag(3.9 + 12e-6 * at + mislaid * w + e, 5e-5), wound=w)
            for at, w, e in zip(s, wound, noise, strict=True)
        ]
        clock, _ = fit_clock("robot", lags)
        z.append((clock.drift - 12e-6) / np.sqrt(clock.covariance[1, 1]))
    assert 0.92 <= (np.abs(z) < 1.96).mean() <= 0.99


def test_friction_that_winds_the_gears_is_found_and_not_where_there_is_none():
    truth, description, chain = (
        rigid_robot.defects(0),
        rigid_robot.described(),
        chain_of(mjcf.urdf(), rigid_robot.described()),
    )
    found, unseen = [], 0.0
    for friction in (1e-12, 2.0):
        rng = np.random.default_rng(5)
        drives = geared_robot.gears(rng)
        drives = replace(drives, coulomb=friction * drives.coulomb, viscous=0.0 * drives.viscous)
        trial = geared_robot.record(truth, drives, geared_robot.swing(rng, 20.0), 12.0, rng)
        model = provisional(chain, description, [trial], CLOCK)
        (reported,) = refined_lags(model, description, [trial], CLOCK)
        found.append(reported.wound)
        unseen = reported.unseen
    assert found[1] - found[0] > 1e-4 > abs(found[0])
    assert 0.0 < unseen < 1e-4  # 0.1 mrad at 0.3 rad/s are 0.3 ms, most of which the fit tells from the lag


def test_a_first_pass_by_fewer_samples_ends_at_the_same_clock(monkeypatch):
    description, chain = rigid_robot.described(), chain_of(mjcf.urdf(), rigid_robot.described())
    rng = np.random.default_rng(5)
    trial = geared_robot.record(
        rigid_robot.defects(0), geared_robot.gears(rng), geared_robot.swing(rng, 20.0), 12.0, rng
    )
    late, found = replace(CLOCK, offset=CLOCK.offset + 4e-3), []
    model = provisional(chain, description, [trial], late)
    for strides in ((1, 1), (4, 1), (4, 4)):
        monkeypatch.setattr("calibration.stages.clocks.pose_refinement._STRIDES", strides)
        found.append(refined(model, description, [trial], late)[0].lag.value)
    assert abs(found[1] - found[0]) < 1e-6 < 1e-5 < abs(found[2] - found[0])


def test_few_samples_all_count():
    few, many = (Samples(*(np.arange(float(n)),) * 6) for n in (399, 400))
    assert len(few.thinned(4).t) == 399 and len(many.thinned(4).t) == 100
