from dataclasses import replace

import numpy as np
import pytest

from calibration.stages.stick_slip.load_shares import prior_by_tilt
from calibration.stages.stick_slip.wheels import WIDE
from tests.calibration.stages.stick_slip.slipping import POSITION, WHEELS

SPRINGS = {"drive": 200e3, "front": 110e3, "back": 160e3}


def stiffness(wheels=WHEELS):
    """(3, 3) of heave and tilt on vertical springs, wheel by wheel."""
    K = np.zeros((3, 3))
    for kind, (x, y) in zip(wheels.types, wheels.position, strict=True):
        a = np.array([1.0, y, -x])
        K += SPRINGS[kind] * np.outer(a, a)
    return K


def test_shares_of_the_load_are_ratios_of_the_springs_that_tilt_shows():
    prior = prior_by_tilt(WHEELS, stiffness())
    np.testing.assert_allclose(np.exp(prior.mean[11:]), [200 / 110, 160 / 110], rtol=0.06)  # the wide prior pulls
    assert np.all((prior.sigma[11:] < 0.2) & (prior.sigma[11:] >= 0.05))
    np.testing.assert_array_equal(prior.mean[:11], WIDE.mean[:11])
    np.testing.assert_array_equal(prior.sigma[:11], WIDE.sigma[:11])


@pytest.mark.parametrize("off", [0.7, 1.3])
def test_heave_that_is_off_by_a_third_moves_shares_by_less_than_their_sigma(off):
    K = stiffness()
    K[0, 0] *= off
    assert np.all(np.abs(prior_by_tilt(WHEELS, K).mean - prior_by_tilt(WHEELS, stiffness()).mean) < 0.7 * WIDE.sigma)
    right = np.log([200 / 110, 160 / 110])
    found = prior_by_tilt(WHEELS, K)
    assert np.all(np.abs(found.mean[11:] - right) < 1.5 * found.sigma[11:])


def test_where_there_are_no_back_casters_their_share_keeps_the_wide_prior():
    wheels = replace(WHEELS, names=WHEELS.names[:4], types=WHEELS.types[:4], position=POSITION[:4])
    prior = prior_by_tilt(wheels, stiffness(wheels))
    assert prior.sigma[12] == pytest.approx(WIDE.sigma[12], rel=0.01)
    assert prior.mean[12] == pytest.approx(WIDE.mean[12], abs=1e-3)
