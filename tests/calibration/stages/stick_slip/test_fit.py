from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from calibration.stages.stick_slip.fit import fit_direction, fitted, left_out
from calibration.stages.stick_slip.likelihood import joined
from calibration.stages.stick_slip.search import displaced, holding, searched, settled, sketched, tried, warmed
from calibration.stages.stick_slip.wheels import (
    FORCE,
    HELD,
    LOGARITHMS,
    NAMES,
    PRIOR,
    PRIOR_SIGMA,
    WIDE,
    SlipParameters,
)
from tests.calibration.stages.stick_slip import slipping
from tests.calibration.stages.stick_slip.slipping import TRUTH

STIFFNESSES = [NAMES.index(name) for name in ("drive_kx", "drive_ky", "front_k", "back_k")]
SHOWN = ("drive_kx", "drive_ky", "front_k", "back_k", "front_mu", "back_mu")


ROWS = [NAMES.index(name) for name in SHOWN]
NEAR = TRUTH.logarithms + np.resize([0.2, -0.2], len(TRUTH.logarithms))


@pytest.fixture(scope="module")
def trials():
    """From inverse dynamics alone, which here are exact."""
    return slipping.campaign(4, seed=5, plate=False)


@pytest.fixture(scope="module")
def found(trials):
    return fitted(trials, warmed(trials, NEAR))


def slip_forces(logarithms):
    """log mu_i N_i of a front and a back caster at rest: what slip shows; the share of N is hardly known before."""
    p = SlipParameters.of(logarithms)
    n, G = slipping.WHEELS.loads(p.drive_load, p.back_load)
    return np.log(np.array([p.front_mu, p.back_mu]) * (n + G @ slipping.WEIGHT)[[2, 4]])


def test_a_fit_finds_what_made_the_data_and_is_sure_of_no_more(trials, found):
    error = (found.logarithms - TRUTH.logarithms)[ROWS]
    sigma = np.sqrt(np.diag(found.covariance))[ROWS]
    np.testing.assert_allclose(error[:4], 0.0, atol=0.02)  # stiffnesses
    np.testing.assert_allclose(slip_forces(found.logarithms), slip_forces(TRUTH.logarithms), atol=0.05)
    assert np.all(np.abs(error) < 4.0 * np.maximum(sigma, 2e-3))
    assert found.cost <= trials.cost(TRUTH.logarithms, trials.errors(TRUTH.logarithms[None])[0]) + 1.0


def test_from_far_off_the_search_comes_to_the_same(trials, found):
    best = searched(trials)
    np.testing.assert_allclose(best.logarithms[STIFFNESSES], found.logarithms[STIFFNESSES], atol=0.03)
    np.testing.assert_allclose(slip_forces(best.logarithms), slip_forces(found.logarithms), atol=0.03)


@dataclass(frozen=True)
class RoughValley:
    """Trials whose cost is |A (p - 1)|^2 and ripples of .1."""

    A: np.ndarray

    prior = SimpleNamespace(information=np.zeros((6, 6)))

    def errors(self, points):
        return list((points - 1.0) @ self.A.T)

    def cost(self, point, error):
        return (error**2).sum() + 0.1 * np.sin(300.0 * point).sum()

    def normal(self, point, error):
        return (self.A.T @ self.A)[None], np.zeros((1, 6))

    def weighed(self, E, steps, error):
        return self.normal(steps, error)


def test_ends_a_deviation_apart_come_to_the_same():
    """A search may end at either, for data that differ by next to nothing."""
    valley = RoughValley(20.0 * np.eye(6) + 3.0 * np.random.default_rng(1).normal(size=(6, 6)))
    way = np.linalg.solve(valley.A, np.full(6, 0.5))
    ends = (settled(valley, point)[0] for point in tried(valley, 1.0 + np.outer([-1.0, 1.0], way)))
    for end in ends:
        assert np.linalg.norm(valley.A @ (end.logarithms - 1.0)) < 0.4


def test_several_starts_are_made_and_the_best_is_kept(trials):
    rough, starts = sketched(trials)
    (best,) = tried(trials.coarse, [rough])
    assert len(starts) >= 2 and best.cost <= min(starts)


def test_long_steps_lead_to_where_short_ones_do(trials, found):
    rough = sketched(trials)[0]
    assert trials.coarse.steps == 1 and trials.steps == 3
    np.testing.assert_allclose((rough - found.logarithms)[ROWS], 0.0, atol=0.15)
    assert searched(trials, rough).cost == pytest.approx(searched(trials).cost)


def test_the_gradient_is_that_of_the_cost(trials):
    at = TRUTH.logarithms + 0.02
    _, g = trials.normal(at, trials.errors(at[None])[0])
    gradient = 2.0 * (g.sum(axis=0) + (at - PRIOR) / PRIOR_SIGMA**2)
    for i in (0, 2, 3, 6):
        step = 0.01 * np.eye(len(NAMES))[i]
        ends = [trials.cost(p, trials.errors(p[None])[0]) for p in (at + step, at - step)]
        assert gradient[i] == pytest.approx((ends[0] - ends[1]) / 0.02, rel=0.05, abs=2.0)


def test_a_friction_that_nothing_reaches_keeps_its_prior(trials):
    """Nor what is a standard deviation less."""
    i = NAMES.index("drive_mu")
    rough = replace(trials, prior=replace(WIDE, mean=WIDE.mean + 0.7 * np.eye(len(NAMES))[i]))
    found = fitted(rough, searched(rough))
    assert found.logarithms[i] == pytest.approx(PRIOR[i] + 0.7, abs=0.05)
    assert np.sqrt(found.covariance[i, i]) > 0.8 * PRIOR_SIGMA[i]


def test_a_friction_that_only_ever_sticks_is_known_on_one_side(trials, found):
    i, highest = NAMES.index("front_mu"), replace(TRUTH, front_mu=0.9)
    rng = np.random.default_rng(5)
    rows = [slipping.recorded(rng, plate=False, truth=highest) for _ in range(3)]
    stuck = joined(slipping.WHEELS, rows)
    start = fitted(stuck, warmed(stuck, highest.logarithms))
    ends = start.logarithms + np.outer([-0.5, 0.5], np.eye(len(NAMES))[i])
    below, above = (stuck.cost(p, e) - start.cost for p, e in zip(ends, stuck.errors(ends), strict=True))
    assert below > 50.0 and above < 5.0
    assert np.sqrt(start.covariance[i, i]) > 0.3 > 3.0 * np.sqrt(found.covariance[i, i])


def test_without_a_trial_the_parameters_are_near_those_of_all(trials, found):
    assert found.others.shape == (len(trials.ids), len(NAMES))
    assert np.abs(found.others - found.logarithms)[:, ROWS].max() < 0.1


def test_trials_left_out_are_predicted(trials):
    direction = fit_direction("dynamics", trials, warmed(trials, NEAR))
    assert np.all(direction.held_out.r2 > 0.98)
    assert direction.held_out.error.shape == (4, 3)
    x = left_out(trials, np.repeat(direction.logarithms[None], 4, axis=0))
    np.testing.assert_array_equal(x, trials.simulated(direction.logarithms[None])[0][0])


def test_a_window_that_slips_as_nobody_could_know_counts_little():
    rng = np.random.default_rng(8)
    rows = [slipping.recorded(rng, plate=False) for _ in range(4)]
    rows[1][1].x[80:] += [3e-3, -2e-3, 20e-3]  # pushed
    known = replace(WIDE, sigma=np.where(np.arange(len(NAMES)) < LOGARITHMS, WIDE.sigma, 1e-3))  # where the load is
    trials = joined(slipping.WHEELS, rows, known)
    found = fitted(trials, warmed(trials, NEAR)).logarithms
    np.testing.assert_allclose((found - TRUTH.logarithms)[STIFFNESSES], 0.0, atol=0.05)
    np.testing.assert_allclose(slip_forces(found), slip_forces(TRUTH.logarithms), atol=0.05)


def test_twice_the_same(trials):
    p = SlipParameters.of(PRIOR).logarithms
    np.testing.assert_array_equal(trials.errors(p[None])[0], trials.errors(p[None])[0])


@pytest.mark.parametrize(("wheel", "axis"), [(0, 0), (3, 1)])
def test_a_wheel_declared_in_a_wrong_place_is_found(trials, found, wheel, axis):
    assert np.abs(displaced(trials, found.logarithms)[0]).max() < 6e-3
    position = trials.wheels.position.copy()
    position[wheel, axis] += 0.03
    wrong = replace(trials, wheels=replace(trials.wheels, position=position))
    shift, gain = displaced(wrong, found.logarithms)
    assert gain.argmax() == wheel and np.abs(shift[wheel]).argmax() == axis
    assert -0.036 < shift[wheel, axis] < -0.012


def test_a_base_that_no_step_can_follow_is_far_off(trials):
    last = trials.windows[0] == 3
    for value in (np.nan, np.inf, 1e9):
        assert trials.variances(trials.error(np.full(trials.measured.shape, value)))[last].min() > 0.1**2


def test_what_wheels_hold_at_the_start_is_seen_by_where_slips_leave_the_base():
    """1.5 N a drive move the base by a third of a millimetre as soon as wheels slip; found to half of it or better."""
    held = replace(TRUTH, drive_held=1.5, back_held=-0.3)
    trials = slipping.campaign(4, seed=5, truth=held)
    free, best = holding(trials, warmed(trials, TRUTH.logarithms))
    found = fitted(free, best)
    assert abs(found.parameters.drive_held - 1.5) < 0.75 and abs(found.parameters.back_held + 0.3) < 0.75
    assert 0.02 < FORCE * np.sqrt(found.covariance[HELD, HELD][0, 0]) < 0.3
    (x, without), _ = trials.simulated(np.array([found.logarithms, np.append(found.logarithms[:-2], [0.0, 0.0])]))
    (true,), _ = trials.simulated(held.logarithms[None])
    assert np.abs(x - true)[:, 0].mean() < 0.7 * np.abs(without - true)[:, 0].mean()


def test_wheels_that_hold_nothing_are_taken_to_hold_nothing(trials):
    best = warmed(trials, TRUTH.logarithms)
    assert holding(trials, best) == (trials, best)
    np.testing.assert_allclose(fitted(trials, best).logarithms[HELD], 0.0, atol=1e-4)
