"""Each error of an instrument is off by default, named in the truth, and read back from the recording."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from twin import motions
from twin.campaign import EPOCH, laboratory, measure
from twin.instruments import force_plate, motion_capture
from twin.instruments.force_plate import PlateErrors
from twin.instruments.motion_capture import MocapErrors
from twin.instruments.robot_log import LogErrors
from twin.instruments.wrist_sensor import WristSensor
from twin.motions import CALIBRATION_SWINGS
from twin.simulation import simulate

START = EPOCH + 3.0


@pytest.fixture(scope="module")
def motion(config):
    return motions.swing("swing", "calibration", "swing", CALIBRATION_SWINGS["x_fold"], 4.0, config.campaign)


@pytest.fixture(scope="module")
def states(lab, motion):
    twin = laboratory(with_errors(lab, mocap=MocapErrors(cameras=((0.0, 0.0, 2.0),))).config, 0).twin
    return simulate(twin, motion, lab.T_lab_base)


def with_errors(lab, **errors):
    return replace(lab, config=replace(lab.config, instruments=replace(lab.config.instruments, **errors)))


@pytest.fixture(scope="module")
def recorded(lab, motion, states):
    """Recording and truth with some errors on."""
    return lambda **errors: measure(with_errors(lab, **errors), motion, states, START)


@pytest.fixture(scope="module")
def plain(recorded):
    return recorded()


def truth_of(lab, **errors):
    return {p.name: p.value for source in with_errors(lab, **errors).instruments for p in source.parameters()}


def test_nothing_is_wrong_unless_it_is_named(lab):
    clocks = {f"clock.{i}.{v}" for i in ("robot", "plate") for v in ("offset", "drift")}
    wrist = {f"wrist.{of}_{what}" for of in ("force", "moment") for what in ("noise", "resolution")}
    noise = {"mocap.noise", "plate.force_noise", "plate.moment_noise", "log.current_quantum"}
    parts = ("encoder.", "frame.", "marker.", "gear.")
    assert {name for name in truth_of(lab) if not name.startswith(parts)} == clocks | wrist | noise


def test_stamps_jitter_by_what_is_said_and_never_go_back(lab, plain, recorded):
    jittered = recorded(log=LogErrors(jitter=4e-4))[0]
    off = jittered.t_robot - plain[0].t_robot
    n = len(off)
    assert chi2.ppf(0.001, n) < (off**2).sum() / 4e-4**2 < chi2.ppf(0.999, n)
    assert np.diff(jittered.t_robot).std() == pytest.approx(0.57e-3, rel=0.1), "as in the real robot's log"
    assert (np.diff(recorded(log=LogErrors(jitter=1e-2))[0].t_robot) > 0.0).all()
    np.testing.assert_array_equal(jittered.q_motor, plain[0].q_motor)


def test_a_late_log_says_what_was_a_moment_ago(lab, plain, recorded):
    late = recorded(log=LogErrors(latency=12e-3))[0]
    n, j = min(len(late.t_robot), len(plain[0].t_robot)), 4
    then = np.interp(late.t_robot[:n] - 12e-3, plain[0].t_robot, plain[0].q_motor[:, j])
    np.testing.assert_allclose(late.q_motor[5 : n - 5, j], then[5 : n - 5], atol=1e-4)
    shift = truth_of(lab, log=LogErrors(latency=12e-3))["clock.robot.offset"] - truth_of(lab)["clock.robot.offset"]
    assert shift == pytest.approx(-12e-3)
    assert truth_of(lab, log=LogErrors(latency=12e-3))["latency.robot"] == 12e-3


def test_velocity_lags_by_the_filter_s_time_constant(plain, recorded):
    slow, fast = recorded(log=LogErrors(velocity_cutoff=8.0))[0].v_motor[:, 4], plain[0].v_motor[:, 4]
    steady = slice(250, 450)  # the swing, without its jerks
    rate = np.gradient(slow, 0.01)
    tau = (rate * (fast - slow))[steady].sum() / (rate**2)[steady].sum()
    assert tau == pytest.approx(1.0 / (2.0 * np.pi * 8.0), rel=0.05)


def test_lost_messages_leave_holes_and_the_rest_as_it_was(plain, recorded):
    trial = recorded(log=LogErrors(dropouts=60.0, dropout_duration=0.2))[0]
    holes = np.diff(trial.t_robot)[np.diff(trial.t_robot) > 0.015]
    assert len(holes) >= 1
    np.testing.assert_allclose(holes, 0.21, atol=0.0051)
    np.testing.assert_array_equal(trial.q_motor, plain[0].q_motor[np.isin(plain[0].t_robot, trial.t_robot)])


def test_late_frames_are_stamped_later_and_everything_is_relative_to_them(lab, plain, recorded):
    errors = MocapErrors(latency=8e-3)
    late, true = recorded(mocap=errors)
    assert late.t_mocap[0] == pytest.approx(START + 8e-3, abs=0.01)
    np.testing.assert_allclose(late.marker_position, true.marker_position, atol=6e-4)
    seen = np.interp(late.t_mocap - 8e-3, plain[1].t_mocap, plain[1].marker_position[:, 8, 0])
    np.testing.assert_allclose(true.marker_position[:, 8, 0], seen, atol=1e-4)
    for name in ("robot", "plate"):
        key = f"clock.{name}.offset"
        assert truth_of(lab, mocap=errors)[key] - truth_of(lab)[key] == pytest.approx(8e-3)


def test_scale_is_that_of_every_distance(plain, recorded):
    scaled = recorded(mocap=MocapErrors(scale=2e-3))[0].marker_position
    np.testing.assert_allclose(np.diff(scaled, axis=1), 1.002 * np.diff(plain[0].marker_position, axis=1), atol=1e-5)


def test_the_bias_field_has_its_size_and_is_smooth():
    errors = MocapErrors(bias=3e-4, bias_length=1.5)
    rng = np.random.default_rng(0)
    p = rng.uniform(-20.0, 20.0, (4000, 3))
    field = np.concatenate(
        [motion_capture.volume(errors, np.random.default_rng(s)).distorted(p) - p for s in range(20)]
    )
    assert field.std() == pytest.approx(3e-4, rel=0.05)
    near = p + 0.01 * rng.normal(size=p.shape)
    volume = motion_capture.volume(errors, rng)
    change = (volume.distorted(near) - near) - (volume.distorted(p) - p)
    assert np.abs(change).max() < 0.1 * 3e-4


def test_swapped_labels_are_two_markers_of_one_body_in_each_other_s_place(plain, recorded):
    errors = MocapErrors(swaps=40.0, swap_duration=0.25)
    p, q, body = recorded(mocap=errors)[0].marker_position, plain[0].marker_position, plain[0].marker_body
    moved = (p != q).any(axis=2)
    rows = np.flatnonzero(moved.any(axis=1))
    assert len(rows) >= 25
    for row in rows:
        a, b = np.flatnonzero(moved[row])
        assert body[a] == body[b]
        np.testing.assert_array_equal(p[row, [a, b]], q[row, [b, a]])


def test_a_marker_is_hidden_where_the_arm_crosses_all_lines_but_one(recorded, states):
    p = recorded()[1].marker_position
    far = MocapErrors(cameras=((-50.0, 0.5, 60.0), (50.0, 0.5, 60.0), (0.9, 50.0, 70.0)), arm_radius=1e-6)
    assert np.isfinite(recorded(mocap=far)[0].marker_position).all()
    near = tuple(states.poses["arm_4_link"][0, :3, 3] + d for d in ([0.02, 0.0, 0.0], [0.0, 0.02, 0.0]))
    errors = MocapErrors(cameras=tuple(tuple(map(float, c)) for c in near))
    assert np.isnan(recorded(mocap=errors)[0].marker_position[0]).all(), "both cameras sit inside the arm"
    assert p.shape == recorded(mocap=errors)[0].marker_position.shape


def test_the_distance_of_segments_is_the_least_over_their_points():
    rng = np.random.default_rng(0)
    p, q, a, b = rng.normal(size=(4, 40, 3))
    u = np.linspace(0.0, 1.0, 201)[:, None, None]
    points = [x + u * (y - x) for x, y in ((p, q), (a, b))]
    brute = np.linalg.norm(points[0][:, None] - points[1][None], axis=-1).min(axis=(0, 1))
    np.testing.assert_allclose(motion_capture.segment_distance(p, q, a, b), brute, atol=2e-2)
    assert (motion_capture.segment_distance(p, q, a, b) <= brute + 1e-12).all()


def test_gains_are_read_back_from_wrenches_in_all_directions(lab):
    errors = PlateErrors(gain=5e-3, crosstalk=8e-3)
    worn = force_plate.sample_plate("plate", errors, np.random.default_rng(3))
    t, rng = np.arange(0.0, 4.0, 1e-3), np.random.default_rng(0)
    wrench = np.repeat(rng.normal(size=(40, 6)), 100, axis=0) * [200.0] * 1
    at = force_plate.Sampling(t[50::100], 0.0, 1000.0, np.full(6, 1e-6))
    seen = force_plate.measured(at, t, wrench, worn, rng)
    G = np.linalg.lstsq(wrench[50::100], seen, rcond=None)[0].T
    np.testing.assert_allclose(G, worn.gain, atol=1e-6)
    named = {p.name: p.value for p in worn.parameters()}
    assert named["plate.plate.gain_26"] == worn.gain[1, 5] and named["plate.plate.gain_11"] == worn.gain[0, 0]


def test_the_offset_drifts_from_the_campaign_s_start_on(lab, plain, recorded):
    errors = PlateErrors(force_drift=0.1, moment_drift=0.02)
    rate = [v for k, v in truth_of(lab, plate=errors).items() if "drift_" in k]
    drifted = recorded(plate=errors)[0]
    true_time = 3.0 + drifted.t_plate - drifted.t_plate[0]
    np.testing.assert_allclose(
        drifted.plate_wrench[:, 0] - plain[0].plate_wrench[:, 0], np.outer(true_time, rate), atol=2e-3
    )


def test_readings_are_multiples_of_the_resolution(recorded):
    w = recorded(plate=PlateErrors(force_resolution=0.5, moment_resolution=0.1))[0].plate_wrench[:, 0]
    np.testing.assert_allclose(w / np.repeat([0.5, 0.1], 3), np.round(w / np.repeat([0.5, 0.1], 3)), atol=1e-9)


@pytest.mark.parametrize("f", [20.0, 60.0])
def test_the_anti_alias_filter_has_the_transfer_function_of_butterworth(f):
    t = np.arange(0.0, 4.0, 1e-3)
    wrench = np.outer(np.sin(2.0 * np.pi * f * t), np.ones(6))
    at = force_plate.Sampling(t[1000:-10], 0.0, 1000.0, np.full(6, 1e-9))
    both = (force_plate.sample_plate("plate", PlateErrors(cutoff=c), np.random.default_rng(0)) for c in (60.0, 0.0))
    filtered, plain = (force_plate.measured(at, t, wrench, p, np.random.default_rng(0))[:, 0] for p in both)
    expected = 1.0 / np.sqrt(1.0 + (f / 60.0) ** 4)
    assert filtered.std() / plain.std() == pytest.approx(expected, rel=0.01)


def test_the_filter_s_delay_is_in_the_plate_s_clock(lab):
    errors = PlateErrors(cutoff=100.0)
    found = truth_of(lab, plate=errors)
    assert found["latency.plate"] == pytest.approx(2.25e-3, rel=0.01)
    assert found["clock.plate.offset"] == pytest.approx(truth_of(lab)["clock.plate.offset"] - found["latency.plate"])


def test_the_wrist_s_readings_have_its_noise_zero_and_steps(lab, recorded, states):
    rough = WristSensor(0.2, 0.01, 0.5, 0.02, force_offset=5.0, moment_offset=0.3)
    trial, _ = recorded(wrist=rough)
    found = truth_of(lab, wrist=rough)
    zero = np.array([found[f"wrist.zero_{k + 1}"] for k in range(6)])
    step = np.repeat([0.5, 0.02], 3)
    w = trial.wrist_wrench
    np.testing.assert_allclose(w / step, np.round(w / step), atol=1e-9)
    rest = w[:100] - zero - states.wrist[:1000].mean(axis=0)
    expected = np.hypot(np.repeat([0.2, 0.01], 3), step / np.sqrt(12.0))
    np.testing.assert_allclose(rest.mean(axis=0), 0.0, atol=4.0 * expected.max() / 10.0)
    assert (0.6 < rest.std(axis=0) / expected).all() and (rest.std(axis=0) / expected < 1.4).all()
    assert np.isnan(recorded(wrist=None)[0].wrist_wrench).all()


def test_current_is_in_whole_steps_of_what_the_drives_push_with(lab, plain, states):
    i, trial = lab.config.instruments, plain[0]
    np.testing.assert_allclose(trial.effort / i.current_quantum, np.round(trial.effort / i.current_quantum), atol=1e-9)
    per_ampere = np.array([lab.config.torso.force_per_ampere, *(j.torque_per_ampere for j in lab.config.arm.values())])
    rest = states.torque[:500].mean(axis=0) / per_ampere
    np.testing.assert_allclose(trial.effort[:40].mean(axis=0), rest, atol=i.current_quantum)
    assert np.abs(rest).max() > 5.0 * i.current_quantum
