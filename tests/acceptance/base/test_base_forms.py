"""The base on other ground than the model's: linear wheels, none, casters that turn, and what no model here contains.

Never worse than the rows without stick-slip; an anchored base is predicted without a slip.
"""

import os
from pathlib import Path

import numpy as np
import pytest

from tests.acceptance.series import series
from tests.doubles.grounds import GROUNDS

pytestmark = pytest.mark.slow
SEED = 1000
WORSE = 1.1  # of the error on the compliance alone, of a base at rest, or of the noise of its markers
NOISE_MM = 0.05
FORMS = {"unmodelled": ("unmodelled", ("twin.campaign.confirmation=false",)),
         **{form: ("humanoids2024", tuple(GROUNDS[form])) for form in ("anchored", "rigid", "turning")}}  # fmt: skip


@pytest.fixture(scope="module", params=FORMS)
def trials(request, tmp_path_factory):
    """What the slipping base does in the trials of one robot; runs in the folder CLAIM_RUNS are read, not repeated."""
    kept, (scenario, overrides) = os.environ.get("CLAIM_RUNS"), FORMS[request.param]
    folder = Path(kept) / request.param if kept else tmp_path_factory.mktemp(request.param)
    (score,) = series(folder, (int(os.environ.get("CLAIM_SEED", SEED)),), overrides, scenario).scores
    return request.param, score["slip"]


def pooled(trials, source, name):
    own = [t for t in trials if t["source"] == source and t["kind"] == "swing"]
    return float(np.sqrt(np.average([t[name] ** 2 for t in own], weights=[t["n"] for t in own])))


@pytest.mark.parametrize("source", ["plate", "dynamics"])
def test_no_worse_than_the_rows_without_stick_slip(trials, source, claim):
    form, found = trials
    hand, others = pooled(found, source, "hand_mm"), [pooled(found, source, k) for k in ("compliance_mm", "still_mm")]
    claim(f"slip/{form}/{source}", [hand, *others])
    assert hand <= max(WORSE * min(others), min(others) + NOISE_MM)


def test_the_band_is_no_lie(trials, claim):
    form, found = trials
    inside = [t["inside_95"] for t in found if t["kind"] == "swing"]
    claim(f"slip/{form}/share in the 95 % band", inside)
    assert np.mean(inside) >= 0.85


def test_no_slip_is_predicted_where_no_wheel_slides(trials):
    form, found = trials
    if form == "anchored":
        assert all(b["slips_from"] == 0 for t in found if t["source"] == "plate" for b in t["by_slips"])
