"""Short campaigns of few postures on robots that no method was developed on: never worse than a registration."""

import os
from pathlib import Path

import numpy as np
import pytest

from tests.acceptance.series import SAMPLED, Key, series

pytestmark = pytest.mark.slow
POSTURES = (12, 16, 20, 24, 40)
QUICK = 24  # postures that a shortened campaign has at most
FIRST, ROBOTS = 4200, 5  # of each count, of fixed arms and of sampled ones
WORSE = 1.03  # than the registration, in the median


@pytest.fixture(scope="module", params=POSTURES)
def campaigns(request, tmp_path_factory):
    """Scores of ten robots with so many calibration postures, half of them sampled whole."""
    kept = os.environ.get("CLAIM_RUNS")
    folder = Path(kept) / "few" if kept else tmp_path_factory.mktemp("few")
    count, seeds = (f"twin.campaign.calibration_postures={request.param}",), range(FIRST, FIRST + ROBOTS)
    arms = {"fixed": (), "sampled": SAMPLED}
    found = [
        series(folder / f"{name}_{request.param}", seeds, (*count, *more), "short", quick=request.param <= QUICK)
        for name, more in arms.items()
    ]
    return request.param, found


def test_the_row_that_is_delivered_is_no_worse_than_a_registration(campaigns, claim):
    n, found = campaigns
    ratio = []
    for arms in found:
        for score in arms.scores:
            rows = {Key(r["model"], r["base"], r["encoder"], r["trials"]): r for r in score["rows"]}
            own, registration = (rows[Key(m, "measured")] for m in (score["main"]["model"], "registration"))
            ratio.append(own["position_rmse_component_mm"] / registration["position_rmse_component_mm"])
    claim(f"few/{n} postures/error over the registration's", np.array(ratio))
    assert np.median(ratio) <= WORSE


def test_intervals_of_few_postures_hold_the_truth(campaigns, claim):
    n, found = campaigns
    share = np.concatenate([arms.coverage() for arms in found])
    claim(f"few/{n} postures/95 % intervals that contain the truth", share)
    assert 0.90 <= np.mean(share)
