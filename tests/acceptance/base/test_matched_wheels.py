"""Bases that are what the stick-slip model says, their wheels any: intervals contain the share they state."""

import numpy as np
import pytest

from calibration.stages.stick_slip.fit import fitted
from calibration.stages.stick_slip.likelihood import joined
from calibration.stages.stick_slip.parameters import KNOWN
from calibration.stages.stick_slip.search import searched
from calibration.stages.stick_slip.wheels import NAMES, PRIOR, PRIOR_SIGMA, Prior, SlipParameters
from tests.calibration.stages.stick_slip import slipping

pytestmark = pytest.mark.slow
ROBOTS, FIRST, TRIALS = 200, 2000, 6
WIDTH = np.minimum(PRIOR_SIGMA, 0.5)  # of the logarithms between robots
TILT = 0.12  # to which tilt shows how wheels share the load
LOADS = [NAMES.index("drive_load"), NAMES.index("back_load")]
JUDGED = [i for i, name in enumerate(NAMES) if "_k" in name or name.endswith("_mu")]


def standardized(seed):
    """Errors over sigma (7,) of stiffnesses and frictions, and which the fit calls known."""
    rng = np.random.default_rng(seed)
    true = SlipParameters.of(PRIOR + WIDTH * rng.normal(size=len(NAMES)))
    prior = Prior(PRIOR.copy(), PRIOR_SIGMA.copy())
    prior.mean[LOADS], prior.sigma[LOADS] = true.logarithms[LOADS] + TILT * rng.normal(size=2), TILT
    rows = [slipping.recorded(rng, plate=False, truth=true) for _ in range(TRIALS)]
    trials = joined(slipping.WHEELS, rows, prior)
    found = fitted(trials, searched(trials))
    sigma = np.sqrt(np.diag(found.covariance))
    return ((found.logarithms - true.logarithms) / sigma)[JUDGED], sigma[JUDGED] < KNOWN


def test_intervals_of_wheels_contain_the_share_they_state(claim):
    z, known = (np.array(part) for part in zip(*map(standardized, range(FIRST, FIRST + ROBOTS)), strict=True))
    share = np.mean(np.abs(z[known]) < 1.96)
    claim(f"matched/wheels/95 % intervals of {ROBOTS} robots", share)
    assert 0.93 <= share <= 0.97
