import logging
from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration.errors import NotEnoughData
from calibration.numerics.signals import RATE, Signal, body_rates, even, low_passed, play
from calibration.numerics.time_delay import Lag, Pair, coarse_lag, fit_lag
from calibration.recording.clock import Clock
from calibration.robot.laboratory import Laboratory
from calibration.stages.clocks.clock_fit import NOT_SHOWN, TrialLag, fit_clock
from calibration.stages.clocks.stage import concluded, synchronise
from tests.doubles import geared_robot, rigid_robot


def error_ms(clock: Clock, epoch: tuple[float, float], t_mocap: np.ndarray) -> np.ndarray:
    return 1e3 * (clock.to_mocap((t_mocap - epoch[0]) / (1.0 + epoch[1])) - t_mocap)


def motion(t: np.ndarray) -> np.ndarray:
    return (np.exp(-0.5 * ((t - 10.0) / 3.0) ** 2) * np.sin(2.0 * t))[:, None]


def signal(t: np.ndarray, x: np.ndarray) -> Signal:
    return Signal(t, x, np.ones(len(t), dtype=bool))


def pair(y, x, z=None, u=None):
    nothing = np.zeros((len(x.t), 0, 1)), np.zeros((len(y.t), 0, 1))
    return Pair(y, x, nothing[0] if z is None else z, nothing[1] if u is None else u)


def test_the_plate_clock_is_found_by_masses_that_move(dataset, truth):
    trials = [trial for _, trial in dataset.trials("calibration")]
    clocks, verdicts = synchronise(Laboratory(dataset.urdf, dataset.description), trials)
    assert [c.instrument for c in clocks] == ["robot", "plate"]
    t = np.linspace(12.0, 200.0, 5)
    assert np.sqrt((error_ms(clocks[1], truth.plate, t) ** 2).mean()) <= 1.0
    assert {v.verdict for v in verdicts} == {"ok"}


def test_statics_and_swings_give_the_robot_clock_to_200_us_behind_gears_that_gravity_loads(truth):
    rng = np.random.default_rng(0)
    drives, (postures, dwells) = geared_robot.gears(rng), geared_robot.statics(rng, 15)
    trials = [
        replace(geared_robot.record(truth, drives, postures, 12.0, rng, dwells=dwells), id="postures"),
        replace(geared_robot.record(truth, drives, geared_robot.swing(rng, 20.0), 100.0, rng), id="swing"),
    ]
    clock = synchronise(Laboratory(mjcf.urdf(), rigid_robot.described()), trials)[0][0]
    assert np.sqrt((error_ms(clock, truth.robot, np.linspace(12.0, 125.0, 5)) ** 2).mean()) <= 0.2


def sweeps(truth, n, seed=0):
    rng = np.random.default_rng(seed)
    drives, joints = geared_robot.gears(rng), (1, 2, 3, 4, 5, 6, 7)
    motors = [geared_robot.sweep(joints[k % 7]) for k in range(n)]
    trials = [geared_robot.record(truth, drives, m, 12.0 + 60.0 * k, rng) for k, m in enumerate(motors)]
    return [replace(t, id=f"sweep{k}") for k, t in enumerate(trials)]


def test_a_campaign_of_sweeps_gives_the_robot_clock_to_300_us(truth):
    clocks, verdicts = synchronise(Laboratory(mjcf.urdf(), rigid_robot.described()), sweeps(truth, 14))
    t = np.linspace(12.0, 12.0 + 60.0 * 14, 8)
    assert np.sqrt((error_ms(clocks[0], truth.robot, t) ** 2).mean()) <= 0.3
    assert "no force plate" in verdicts[-1].message


def test_one_trial_whose_clock_jumped_does_not_matter_and_is_named(truth):
    trials = sweeps(truth, 7)
    trials[3] = replace(trials[3], t_robot=trials[3].t_robot + 0.05)
    clocks, verdicts = synchronise(Laboratory(mjcf.urdf(), rigid_robot.described()), trials)
    assert np.abs(error_ms(clocks[0], truth.robot, np.array([200.0]))).max() <= 0.5
    assert any(v.verdict == "warning" and "sweep3" in v.message for v in verdicts)


def test_a_robot_that_stands_still_has_no_clock(truth, caplog):
    still = np.repeat(rigid_robot.CENTRE[None], 4000, axis=0)
    trial = rigid_robot.record(truth, still, 12.0, np.random.default_rng(0))
    with caplog.at_level(logging.INFO), pytest.raises(NotEnoughData, match="arm motion"):
        synchronise(Laboratory(mjcf.urdf(), rigid_robot.described()), [trial])


@pytest.mark.parametrize("true_lag", [3.9, -0.0123, -7.0])
def test_a_lag_is_found_whatever_gain_and_offset(true_lag):
    t = np.arange(0.0, 20.0, 1.0 / RATE)
    x = signal(t, motion(t))
    y = signal(t + true_lag + 0.003, 1.7 * motion(t + 0.003) + 0.4)
    assert coarse_lag(y, x) == pytest.approx(true_lag, abs=0.011)
    assert fit_lag(pair(y, x), coarse_lag(y, x)).value == pytest.approx(true_lag, abs=1e-7)


def test_the_sigma_of_a_lag_is_its_scatter_when_the_noise_is_correlated():
    rng, t = np.random.default_rng(0), np.arange(0.0, 20.0, 1.0 / RATE)
    x = signal(t, motion(t))
    found = []
    for _ in range(60):
        noise = low_passed(signal(t, rng.normal(size=(len(t), 1))), 3.0)
        found.append(fit_lag(pair(signal(t, x.x + 0.2 * noise.x), x), 0.0))
    scatter, stated = np.std([f.value for f in found]), np.mean([f.sigma for f in found])
    assert 0.7 < stated / scatter < 1.4


def test_a_reading_sigmas_centred_and_follows_half_a_gap_behind():
    q = np.array([0.0, 0.5, 3.0, 2.5, 1.5, 0.0])[:, None]
    np.testing.assert_array_equal(play(q, np.array([1.0]))[:, 0], [0.0, 0.0, 2.0, 2.0, 2.0, 1.0])


def test_backlash_shifts_a_lag_by_its_formula_unless_its_term_is_there():
    t, gap, amplitude, f = np.arange(0.0, 20.0, 1.0 / RATE), 1e-3, 0.5, 0.2
    q = amplitude * np.sin(2.0 * np.pi * f * t)[:, None]
    link = play(q, np.array([gap]))
    x, y = (low_passed(signal(t, np.gradient(a, 1.0 / RATE, axis=0)), 6.0) for a in (q, link))
    lost = low_passed(signal(t, np.gradient(link - q, 1.0 / RATE, axis=0)), 6.0).x[:, None]
    plain, reported = fit_lag(pair(y, x), 0.0).value, fit_lag(pair(y, x, lost), 0.0).value
    assert plain == pytest.approx(4.0 * gap / (np.pi * amplitude * 2.0 * np.pi * f), rel=0.1)
    assert abs(reported) < 1e-6


def test_what_goes_on_at_the_instants_of_y_is_distinguished_from_the_lag():
    t = np.arange(0.0, 20.0, 1.0 / RATE)
    x = signal(t, motion(t))
    y = signal(t + 0.5, motion(t) + 0.3 * np.roll(motion(t), 30))
    u = np.roll(motion(t), 30)[:, None]
    assert abs(fit_lag(pair(y, x), 0.5).value - 0.5) > 1e-2
    assert fit_lag(pair(y, x, u=u), 0.5).value == pytest.approx(0.5, abs=1e-7)


def test_records_of_different_motions_have_no_lag():
    t = np.arange(0.0, 20.0, 1.0 / RATE)
    other = np.random.default_rng(0).normal(size=(len(t), 1))
    with pytest.raises(NotEnoughData, match="same motion"):
        fit_lag(pair(low_passed(signal(t, other), 2.0), signal(t, motion(t))), 0.0)


def test_the_clock_is_that_of_the_weighted_line_and_goes_both_ways():
    s = np.array([100.0, 300.0, 500.0, 900.0])
    trials = [TrialLag(str(k), x, Lag(3.9 + 40e-6 * x, 1e-6)) for k, x in enumerate(s)]
    clock, outliers = fit_clock("robot", trials)
    assert outliers == ()
    assert clock.offset == pytest.approx(3.9, abs=1e-6)
    assert clock.drift == pytest.approx(40e-6, rel=1e-3)  # the prior of 100 ppm pulls by parts in a million
    np.testing.assert_allclose(clock.from_mocap(clock.to_mocap(s)), s, atol=1e-12)
    at_epoch = np.array([1.0, clock.epoch])
    assert np.sqrt(at_epoch @ clock.covariance @ at_epoch) == pytest.approx(clock.sigma)


def test_a_motion_that_hardly_moves_the_plate_contradicts_no_clock():
    known = rigid_robot.described().tolerances
    rng = np.random.default_rng(3)
    lags = [TrialLag(f"swing_{i}", 20.0 * i, Lag(2.0 + 3e-4 * rng.normal(), 3e-4)) for i in range(6)]
    weak = TrialLag("sweep", 130.0, Lag(1.0, 2e-2))  # a second off, by its own measure fifty standard deviations
    jumped = TrialLag("jumped", 150.0, Lag(1.0, 4e-4))
    _, verdicts = concluded("plate", [*lags, weak], known)
    assert [v.verdict for v in verdicts] == ["ok"] and "6 trials; 1 move too little to tell" in verdicts[0].message
    _, verdicts = concluded("plate", [*lags, weak, jumped], known)
    assert [v.verdict for v in verdicts] == ["ok", "warning"]
    assert "jumped" in verdicts[1].message and "sweep" not in verdicts[1].message


@pytest.mark.parametrize(
    ("plain", "named"),
    [(None, True), (Lag(1.985, 2e-3), True), (Lag(1.985, 4e-3), False), (Lag(2.0, 2e-3), False), (NOT_SHOWN, False)],
)
def test_a_trial_that_only_its_nuisances_take_from_the_others_contradicts_no_clock(plain, named):
    lags = [TrialLag(f"swing_{i}", 20.0 * i, Lag(2.0 + 1e-5 * i, 3e-4)) for i in range(6)]
    far = TrialLag("sweep", 130.0, Lag(1.98, 2e-3), plain=plain)
    clock, verdicts = concluded("plate", [*lags, far], rigid_robot.described().tolerances)
    assert (len(verdicts) == 2) is named and clock.offset == pytest.approx(2.0, abs=1e-4)


def test_a_plate_whose_clock_jumped_in_one_trial_is_named(dataset):
    trials = [trial for _, trial in dataset.trials("calibration")]
    moved = [replace(t, t_plate=t.t_plate + 0.03) if t.id == "swing" else t for t in trials]
    _, verdicts = synchronise(Laboratory(dataset.urdf, dataset.description), moved)
    assert [v.message.rsplit(": ", 1)[1] for v in verdicts if v.verdict == "warning"] == ["swing"]


def test_one_trial_gives_an_offset_and_no_drift():
    clock, _ = fit_clock("robot", [TrialLag("one", 400.0, Lag(2.0, 1e-4))])
    assert clock.drift == 0.0
    assert clock.to_mocap(np.array([400.0]))[0] == pytest.approx(402.0, abs=1e-9)
    assert np.sqrt(clock.covariance[1, 1]) == pytest.approx(1e-4)


def test_scatter_between_trials_counts_in_the_clock_s_sigma():
    rng = np.random.default_rng(1)
    trials = [TrialLag(str(k), 50.0 * k, Lag(2.0 + 1e-3 * rng.normal(), 1e-5)) for k in range(20)]
    scatter = np.std([t.lag.value for t in trials]) / np.sqrt(20.0)
    assert fit_clock("robot", trials)[0].sigma == pytest.approx(scatter, rel=0.1)
    assert fit_clock("robot", trials, 5e-4)[0].sigma == pytest.approx(np.hypot(scatter, 5e-4), rel=0.1)


def test_filters_have_zero_phase():
    t = np.arange(0.0, 30.0, 1.0 / RATE)
    slow = signal(t, np.sin(2.0 * np.pi * 0.5 * t)[:, None])
    middle = slice(500, -500)
    filtered = low_passed(slow, 6.0).x[middle, 0]
    np.testing.assert_allclose(filtered, slow.x[middle, 0], atol=1e-4)


def test_holes_are_not_compared():
    t = np.delete(np.arange(0.0, 10.0, 0.01), slice(300, 320))
    found = even(t, motion(t))
    assert not found.valid[305:315].any() and found.valid[:298].all() and found.valid[325:].all()


def test_body_rates_of_a_steady_turn_are_its_rate():
    t = np.arange(0.0, 1.0, 0.01)
    R = np.array([rigid_robot.se3(np.r_[0, 0, 0, 0.2 * x, -0.1 * x, 0.5 * x])[:3, :3] for x in t])
    R[40] = np.nan
    when, w = body_rates(t, R)
    assert len(when) == len(t) - 2
    np.testing.assert_allclose(w, np.tile([0.2, -0.1, 0.5], (len(w), 1)), atol=1e-9)
