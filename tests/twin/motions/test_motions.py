from dataclasses import replace

import numpy as np
import pytest

from scenarios import load
from twin.errors import Unreachable
from twin.motions import CALIBRATION_SWINGS, JOINTS, RATE, postures, sample_postures, schedule
from twin.motions import motion as motions
from twin.simulation import simulate


def test_path_time_ramps_cruises_and_stops():
    t = np.linspace(-1.0, 11.0, 1201)
    s = motions.path_time(t, 10.0, 0.5)
    speed = np.gradient(s, t)
    assert s[0] == 0.0 and s[-1] == pytest.approx(9.5)
    assert np.all(np.diff(s) >= 0.0)
    np.testing.assert_allclose(speed[(t > 0.6) & (t < 9.4)], 1.0, atol=1e-9)
    np.testing.assert_allclose(speed[np.abs(t - 0.25) < 0.005], 0.5, atol=0.03)


@pytest.mark.parametrize(("duration", "parts"), [(25.0, 4), (12.0, 2), (4.0, 1)])
def test_a_halting_swing_stops_after_each_period_for_as_long(duration, parts):
    t = np.linspace(0.0, duration, 2501)
    moves = np.diff(motions.halting_time(t, duration, 0.12, 5.0)) > 1e-9
    change = np.diff(np.concatenate([[False], moves, [False]]).astype(int))
    starts, stops = np.flatnonzero(change == 1), np.flatnonzero(change == -1)
    assert len(starts) == len(stops) == parts and starts[0] == 0 and abs(stops[-1] - 2500) <= 1
    np.testing.assert_allclose(t[stops - 1] - t[starts], min(5.12, duration), atol=0.02)
    rests = t[starts[1:]] - t[stops[:-1]]
    np.testing.assert_allclose(rests, (duration - 5.12 * parts) / max(parts - 1, 1), atol=0.02)
    assert motions.halting_time(t, duration, 0.12, 5.0)[-1] == pytest.approx(parts * min(5.0, duration - 0.12))


def test_every_trial_starts_and_ends_with_a_second_of_rest_inside_the_limits(config, nominal):
    limits = np.array([nominal.joint(j).range for j in JOINTS])
    for motion in schedule(config.campaign, nominal, 3):
        rest = round(RATE)
        assert np.ptp(motion.command[: rest + 1], axis=0).max() == 0.0, motion.id
        assert np.all((motion.command >= limits[:, 0]) & (motion.command <= limits[:, 1])), motion.id
        if motion.kind != "static":
            assert np.ptp(motion.command[-rest:], axis=0).max() == 0.0, motion.id


def test_dwells_are_where_the_command_stands_still(config, nominal):
    motion = schedule(config.campaign, nominal, 3)[0]
    t = np.arange(len(motion.command)) / RATE
    assert len(motion.dwells) == config.campaign.calibration_postures == len(motion.approach)
    for (start, stop), approach in zip(motion.dwells, motion.approach, strict=True):
        inside = (t >= start - 1e-9) & (t <= stop + 1e-9)
        assert np.ptp(motion.command[inside], axis=0).max() < 1e-12
        arriving = motion.command[inside][0] - motion.command[np.flatnonzero(inside)[0] - 5]
        np.testing.assert_array_equal(np.sign(np.round(arriving, 9)), approach)


def test_no_validation_posture_is_a_calibration_posture(config, nominal):
    trials = {m.id: m for m in schedule(config.campaign, nominal, 3)}
    a, b = trials["postures"], trials["postures_validation"]
    ends = [m.command[np.round(m.dwells[:, 1] * RATE).astype(int)] for m in (a, b)]
    nearest = np.abs(ends[0][:, None] - ends[1][None]).max(axis=2).min()
    assert nearest > 0.05


def test_postures_that_do_not_exist_are_reported(nominal, monkeypatch):
    monkeypatch.setattr(postures, "_admissible", lambda *a: False)
    with pytest.raises(Unreachable, match="found 0 of 3 postures"):
        sample_postures(nominal, 3, np.random.default_rng(0))


def test_nothing_in_validation_starts_as_abruptly_about_the_vertical_as_a_calibration_swing(config, nominal):
    """Else drive wheels slide there that slid in no calibration trial."""
    peak = {m.id: np.abs(np.diff(m.command[:, 1], 2)).max() for m in schedule(config.campaign, nominal, 3)}
    assert peak["around_z"] > 1.2 * max(peak[name] for name in ("xyz", "xyz_mirror", "postures_validation"))


def test_a_soft_start_is_soft(config):
    def first_step(ramp):
        campaign = replace(config.campaign, ramp=ramp)
        path = CALIBRATION_SWINGS["around_z"]
        q = motions.swing("a", "calibration", "swing", path, 6.0, campaign).command
        return np.abs(np.diff(q, 2, axis=0)).max() * RATE**2

    assert first_step(1.5) < 0.2 * first_step(0.12)


def test_moves_between_postures_have_a_ramp_of_their_own(config):
    through = np.zeros((2, 8))
    through[1, 1] = 1.0

    def command(**ramps):
        return motions.static_postures("a", "calibration", through, replace(config.campaign, **ramps)).command[:, 1]

    soft, abrupt = command(ramp=0.12, posture_ramp=0.6), command(ramp=0.12, posture_ramp=None)
    speed = [np.abs(np.diff(q)).max() * RATE for q in (soft, abrupt)]
    np.testing.assert_allclose(speed, min(config.campaign.speed, 2.0), rtol=0.02)
    acceleration = [np.abs(np.diff(q, 2)).max() * RATE**2 for q in (soft, abrupt)]
    np.testing.assert_allclose(acceleration, [speed[0] / 0.6, speed[1] / 0.12], rtol=0.05)
    np.testing.assert_array_equal(command(ramp=0.6, posture_ramp=None), soft)


def test_the_tour_with_jolts_leaves_every_other_trial_as_it_is(config, nominal):
    """Its postures are those of validation, reached as abruptly as swings start."""
    soft = {m.id: m for m in schedule(config.campaign, nominal, 3)}
    asked = load("jolts").twin.campaign
    names = tuple(dict.fromkeys((*asked.only, "postures_validation")))
    found = {m.id: m for m in schedule(replace(config.campaign, only=names), nominal, 3)}
    jolted = found.pop("postures_jolts")
    assert list(found) == list(soft) and "postures_validation" not in asked.only
    for name, motion in found.items():
        np.testing.assert_array_equal(motion.command, soft[name].command)
    peak = [np.abs(np.diff(m.command, 2, axis=0)).max() for m in (jolted, found["postures_validation"])]
    assert peak[0] > 3.0 * peak[1] and len(jolted.dwells) == config.campaign.validation_postures


@pytest.mark.parametrize(("duration", "amplitude"), [(3.0, 0.15), (6.0, 0.3), (12.0, 0.6), (20.0, 0.6)])
def test_a_short_sweep_is_smaller_rather_than_faster(duration, amplitude):
    path = motions.sweep_path("arm_1_joint", duration)
    assert max(path.amplitude) == pytest.approx(amplitude)
    t = np.linspace(0.0, duration, 1000)
    assert np.abs(np.gradient(path.at(t), t, axis=0)).max() < 0.63


def test_the_sweep_of_a_quick_campaign_leaves_the_base_where_it_was(lab):
    path = motions.sweep_path("arm_1_joint", 3.0)
    motion = motions.swing("s", "calibration", "sweep", path, 3.0, lab.config.campaign)
    base = simulate(lab.twin, motion, lab.T_lab_base).poses["base_footprint"]
    moved = np.linalg.inv(base[0]) @ base[-1]
    assert np.linalg.norm(moved[:3, 3]) < 1e-3 and abs(np.arctan2(moved[1, 0], moved[0, 0])) < 2e-3
