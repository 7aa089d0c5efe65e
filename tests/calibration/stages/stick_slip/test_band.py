import numpy as np
import pytest

from calibration.stages.stick_slip.band import (
    FAR,
    LEAST,
    LEAST_HEAVE,
    OTHER,
    PRIOR,
    Band,
    LeftOut,
    ensemble_of,
    fitted_band,
    heave_band,
    other_start,
    plain_band,
    reached,
)
from calibration.stages.stick_slip.model import believed
from calibration.stages.stick_slip.wheels import DRIVES, NAMES
from tests.calibration.stages.stick_slip import slipping
from tests.calibration.stages.stick_slip.slipping import TRUTH

NOISE = np.array([1e-6, 1e-6, 1e-6])


def rows(rng, n, size=1.0, corrected=True):
    """Trials whose errors, one each, grow with the slip and the members' spread `size` times as robots' do."""
    ensemble, preloaded = rng.gamma(1.0, 1e-11, (n, 3)), rng.gamma(1.0, 1e-9, (n, 3))
    slipped = rng.gamma(1.0, 1e-6, (n, 3))
    s, r, p, slip = size * np.exp(PRIOR[0 if corrected else 1]).T
    V = np.maximum(s, LEAST) ** 2 + r**2 * ensemble + p**2 * preloaded + slip**2 * slipped
    return LeftOut(V * rng.normal(size=(n, 3)) ** 2, ensemble, preloaded, slipped)


@pytest.mark.parametrize(
    ("corrected", "size", "low", "high"),
    [
        (True, 0.5, 0.93, 0.99),
        (True, 1.0, 0.90, 0.98),
        (True, 2.0, 0.87, 0.98),
        (True, 8.0, 0.87, 0.98),
        (False, 1.0, 0.90, 0.98),
    ],
)
def test_the_band_holds_its_share_of_what_it_has_not_seen(corrected, size, low, high):
    rng = np.random.default_rng(1)
    share = []
    for _ in range(40):
        band = fitted_band(rows(rng, 13, size, corrected), NOISE, np.zeros((13, 3)), corrected)
        new = rows(rng, 100, size, corrected)
        V = band.variance(new.ensemble, new.preloaded, new.slipped)
        share.append((new.square < 1.96**2 * V).mean(axis=0))
    assert np.all(np.mean(share, axis=0) > low) and np.all(np.mean(share, axis=0) < high)


def test_the_band_grows_with_the_largest_slip_and_never_shrinks_below_its_floor():
    band = Band(*(np.full(3, v) for v in (2e-5, 1.0, 1.0, 1e-2)))
    slip = np.repeat([0.0, 2e-3, 1e-3], 50)[:, None] * np.ones(3)
    V = band.variance(np.zeros((150, 3)), np.zeros((150, 3)), reached(slip))
    np.testing.assert_allclose(V[:50], 4e-10)
    np.testing.assert_allclose(V[50:], 4e-10 + 4e-10)


def test_a_base_that_begins_under_another_load_is_preloaded_the_more():
    band = Band(*np.ones((4, 3)), np.array([40.0, 5.0]))
    np.testing.assert_allclose(band.begun(np.array([730.0, 40.0, 5.0])).start, 1.0)
    half = band.begun(np.array([700.0, 40.0, 5.0 + FAR])).start
    np.testing.assert_allclose(half, np.sqrt(1.0 + 0.5 * OTHER**2))
    most = band.begun(np.array([700.0, 40.0, 5.0 + 1e3 * FAR])).start
    np.testing.assert_allclose(most, np.sqrt(1.0 + OTHER**2), rtol=1e-6)
    found = fitted_band(
        rows(np.random.default_rng(2), 5), NOISE, np.array([[0.0, 40.0, 5.0]] * 3 + [[0.0, 9.0, 9.0]] * 2)
    )
    np.testing.assert_array_equal(found.usual, [40.0, 5.0])
    loads = np.array([[40.0, 5.0], [40.0, 5.0 + FAR]])
    np.testing.assert_allclose(other_start(loads, found.usual), [0.0, 0.5 * OTHER**2])


def test_a_slip_is_believed_as_far_as_it_is_larger_than_its_band():
    slip = np.array([[0.0, 1e-3, 1e-3], [1e-3, 1e-3, 1e-4]])
    kept = believed(reached(slip), np.array([[0.0, 0.0, 1e-6], [2e-6, 5e-7, 2.5e-7]]))
    np.testing.assert_allclose(kept, [[1.0, 1.0, 0.0], [0.0, 0.5, 0.75]])


def test_members_are_draws_of_the_posterior_that_the_data_bear():
    trials = slipping.campaign(3, seed=2)
    p = TRUTH.logarithms
    one_sided = np.diag(np.where([name == "drive_mu" for name in NAMES], 0.7, 1e-4) ** 2)
    members = ensemble_of(trials, p, one_sided)
    np.testing.assert_array_equal(members[0], p)
    drives = members[1:, NAMES.index("drive_mu")] - p[NAMES.index("drive_mu")]
    assert (drives > 0.0).mean() > 0.6  # less friction would slip, and none of the trials does
    np.testing.assert_array_equal(members, ensemble_of(trials, p, one_sided))
    spread = ensemble_of(trials, p, 1e-8 * np.eye(len(p))).std(axis=0)
    np.testing.assert_allclose(spread, np.where([name == "drive_mu" for name in NAMES], DRIVES, 0.0), atol=0.02)


def test_an_axis_that_is_not_moved_is_known_the_less_the_more_the_base_is_shaken():
    """Trials that hardly move must not make the band of those that move much narrow."""
    rng = np.random.default_rng(3)
    reach = np.repeat([1e-10, 1e-6], [9, 4])[:, None] * np.ones(3)
    square = 1e-10 + 0.25 * reach * rng.normal(size=reach.shape) ** 2
    band = plain_band(square, reach, NOISE)
    V = band.variance(reached(np.array([[1e-6], [3e-3], [-1e-6]]) * np.ones(3)))
    assert np.all(V[0] < 1e-9) and np.all(np.abs(np.sqrt(V[1]) / 1.5e-3 - 1.0) < 0.6)
    np.testing.assert_array_equal(V[2], V[1])


def tilted(rng, growth, noise, n=13, b=400):
    """Trials in which heave and tilt err by a share of what they reach, slowly, and markers by white noise."""
    t = np.arange(b)[:, None]
    reach = [np.maximum.accumulate((s * np.sin(t / 40.0) * np.ones(3)) ** 2) for s in rng.uniform(5e-4, 3e-3, n)]
    slow = [np.sin(t / rng.uniform(3.0, 30.0, 3) + rng.uniform(0.0, 6.3, 3)) * np.sqrt(2.0 * h) for h in reach]
    return [growth * e + noise * rng.normal(size=e.shape) for e in slow], reach


@pytest.mark.parametrize(("growth", "noise"), [(0.02, 1e-7), (0.02, 1e-4), (0.2, 1e-4)])
def test_tilt_errs_by_the_share_that_markers_show_beneath_their_noise(growth, noise):
    found = heave_band(*tilted(np.random.default_rng(3), growth, noise))
    np.testing.assert_allclose(found.growth[1:], growth, rtol=0.25)


def test_what_noise_hides_of_a_tilt_is_not_known_to_be_nothing():
    hidden = heave_band(*tilted(np.random.default_rng(4), 1e-5, 1e-4)).growth
    assert np.all(hidden[1:] >= LEAST_HEAVE[1, 1:]) and np.all(hidden[1:] < 2.0 * LEAST_HEAVE[1, 1:])
    np.testing.assert_array_equal(heave_band(*tilted(np.random.default_rng(4), 1e-5, 1e-7)).growth, LEAST_HEAVE[1])


def test_one_trial_in_which_wheels_lift_off_does_not_widen_the_band_of_tilt():
    left, reach = tilted(np.random.default_rng(5), 0.02, 1e-5)
    before = heave_band(left, reach).growth
    left[4] = 20.0 * left[4]
    assert np.all(heave_band(left, reach).growth < 1.2 * before)
    left[5] = np.where(np.arange(400)[:, None] % 7, left[5], np.nan)
    assert np.all(np.isfinite(heave_band(left, reach).growth))
