"""Robots that are what the geometric model says: intervals hold what they promise, and nothing is seen that is not."""

import numpy as np
import pytest
from scipy import stats

from calibration.stages.geometry import calibrate_geometry, geometry_parameters
from scenarios import load
from scenarios.score.parameters import judge_parameters
from scenarios.studies.effect_power import power
from scenarios.studies.matched_run import matched_robot
from twin.truth import Parameter

pytestmark = pytest.mark.slow
ROBOTS = {"short": 1000, "humanoids2024": 1000}
FIRST = 2000  # seed; earlier ones have been used to develop
SIZES = (5e-4, 2e-3, 8e-3)  # [rad]


@pytest.fixture(scope="module", params=ROBOTS)
def clean(request):
    """The campaign's name, each robot's judged parameters, and the effects seen on it."""
    found = []
    for seed in range(FIRST, FIRST + ROBOTS[request.param]):
        one = matched_robot(load(request.param, [f"seed={seed}"]))
        model, _ = calibrate_geometry(one.chain, one.description, one.seen)
        p = geometry_parameters(one.chain, one.description)
        true = tuple(map(Parameter, p.names, p.units, one.theta.tolist()))
        found.append((judge_parameters(model, true), [t.name for t in model.tests if t.seen]))
    return request.param, found


def test_intervals_hold_the_share_they_promise(clean, claim):
    name, found = clean
    share = sum(j.n_covered for j, _ in found) / sum(j.n_judged for j, _ in found)
    claim(f"matched/{name}/95 % intervals of {len(found)} robots", share)
    assert 0.93 <= share <= 0.97


def test_errors_of_all_parameters_are_as_their_covariance_has_them(clean, claim):
    name, found = clean
    nees = np.array([j.nees / j.dof for j, _ in found])
    claim(f"matched/{name}/NEES per degree of freedom", nees)
    assert abs(nees.mean() - 1.0) <= 0.1


def test_nothing_wrong_in_nothing_significant_out(clean, claim):
    name, found = clean
    seen = sum(bool(names) for _, names in found)
    claim(f"matched/{name}/false alarms of {len(found)} robots", seen / len(found))
    least, most = stats.binom.interval(0.99, len(found), 0.01)
    assert least <= seen <= most


@pytest.mark.parametrize("effect", ["time", "reversal", "load", "posture"])
def test_the_larger_an_effect_the_more_often_it_is_seen_by_its_name(effect, claim):
    found = power(load("short", [f"seed={FIRST}", "twin.campaign.calibration_postures=40"]), effect, 20, SIZES)
    for one in found:
        claim(f"power/{effect}, {one.size_mrad} mrad, {one.hand_mm:.1f} mm at the hand", one.seen.value)
    assert [one.seen.value for one in found] == sorted(one.seen.value for one in found)
    assert sum(one.misnamed.value for one in found) <= 0.05 * len(found)
