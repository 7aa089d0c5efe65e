"""Drawn robots against the log of a real one."""

from dataclasses import fields, replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

import mjcf
from calibration import load as load_dataset
from calibration.errors import NotEnoughData
from calibration.mocap.cluster_pose import body_poses
from calibration.mocap.cluster_shape import per_coordinate
from calibration.numerics.signals import Signal, even, low_passed, play
from scenarios import load
from scenarios.commands import main
from scenarios.realism.arm_as_logged import AS_LOGGED
from scenarios.realism.compare import compare_replay, compare_swings
from scenarios.realism.log import Recorded, recorded, referred
from scenarios.realism.replayed import AS_DRAWN, CAUSES, Condition, floor_of, gripping, inside, together
from scenarios.realism.swings import LOG, Figures, SwingResponse, figures, yaw_from_moment
from scenarios.steps import import_export
from twin.motions import JOINTS

ROOT = Path(__file__).parents[3]
LOG_FILE = ROOT / "tests/data/vicon_forceplate_2023-09-20.csv"
T = np.arange(0.0, 30.0, 0.01)
START = 23.416  # [s] of the log, where the fitted swings are at rest
AXES = ("x", "y", "z", "roll", "pitch", "yaw")
ASKED = {"as sampled": ("y", "roll", "pitch", "yaw"), "markers shift": AXES[1:], "and casters turn": AXES}
OPEN = {40: {("as sampled", "pitch")}}  # 79.5 % of the time, docs/limits.md


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """The public log as a dataset."""
    folder = tmp_path_factory.mktemp("log") / "dataset"
    import_export.import_files("csv", [LOG_FILE], ROOT / "docs/mappings/vicon_forceplate.yaml", folder)
    return folder


def swing_of(amplitude, start=0.0):
    """A 0.2 Hz cycle between 2 s and 28 s, with a constant `start` from then on."""
    moving = (T >= 2.0) & (T <= 28.0)
    wave = amplitude * np.sin(2 * np.pi * 0.2 * (T - 2.0)) * moving
    return wave + start * (T >= 2.0)


def test_figures_are_those_of_the_motion():
    rotation = np.column_stack([swing_of(1e-3), swing_of(2e-3), swing_of(3e-3, 4e-3)])
    centroid = np.column_stack([swing_of(1e-4), swing_of(2e-4), swing_of(3e-4)])
    wrench = np.column_stack([swing_of(a) for a in (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)])
    f = figures(SwingResponse(T, rotation, centroid, wrench), 2.0)
    assert (f.steady_roll, f.steady_pitch, f.steady_yaw) == pytest.approx((2e-3, 4e-3, 6e-3), rel=0.02)
    assert (f.roll, f.pitch, f.yaw) == pytest.approx((2e-3, 4e-3, 7e-3), rel=0.02)
    assert f.set == pytest.approx(4e-3, rel=0.01)
    assert (f.x, f.y, f.z) == pytest.approx((2e-4, 4e-4, 6e-4), rel=0.01)
    assert (f.Fz, f.Mx, f.My, f.Mz) == pytest.approx((6.0, 8.0, 10.0, 12.0), rel=0.02)
    assert set(LOG) == {field.name for field in fields(Figures)}


def test_yaw_that_slips_is_poorly_described_by_a_line_and_well_by_play():
    moment = 10.0 * np.sin(2 * np.pi * 0.2 * T) * (1.0 + 0.3 * np.sin(2 * np.pi * 0.05 * T))
    slipping = 1e-3 * play(moment[:, None], np.array([4.0]))[:, 0]
    straight = yaw_from_moment(1e-3 * moment, moment)
    assert straight.linear == pytest.approx(1.0) and straight.hysteretic == pytest.approx(1.0)
    found = yaw_from_moment(slipping, moment)
    assert found.linear < 0.9 and found.hysteretic > 0.95


def test_a_measurement_lies_inside_where_it_lies_among_the_draws():
    x = np.zeros((len(T), 6))
    x[:, 2] = np.where(T < 15.0, 0.0, 9.0)
    x[:, 5] = 9.0
    trial = Recorded("a", T, np.zeros(6), np.zeros_like(x), x, np.zeros((3, 3)), None, np.zeros((len(T), 9)))
    draws = np.linspace(-1.0, 1.0, 20)[:, None, None] + np.zeros((20, *x.shape))
    found = inside(trial, draws)
    assert found.share == pytest.approx([1.0, 1.0, 0.5, 1.0, 1.0, 0.0])
    assert together([found, found]) == pytest.approx(found.share)


def test_grip_scales_friction_and_nothing_else():
    base = load("humanoids2024").twin.base
    more = gripping(base, 2.0)
    assert (
        more.drive.friction == 2.0 * base.drive.friction
        and more.caster_back.friction == 2.0 * base.caster_back.friction
    )
    assert more.drive.stiffness == base.drive.stiffness and more.pose == base.pose


def test_wheels_under_turning_casters_are_drawn_each_on_its_own():
    config = load("reality").twin
    right, left, front, other, back, _ = floor_of(config, 3, Condition(turning=True), 600.0)
    assert front.turning_force != other.turning_force and right.bushing != left.bushing
    assert front.turning_force == pytest.approx(front.footing.friction / 10.0 * 100.0)
    assert back.turning_force > 0.0 and left.turning_force == 0.0 and left.footing.friction > 2.0


def test_a_recording_gives_the_wrench_on_a_floor_that_feels_no_offset(log):
    slow, cycles = recorded(load_dataset(log))
    assert (slow.trial_id, cycles.trial_id) == ("slow", "cycles")
    assert slow.rest[[0, 1, 5]] == pytest.approx([0.0, 0.0, 0.0]) and slow.rest[2] == pytest.approx(-730.0, abs=1.0)
    assert np.ptp(cycles.x[:, 5]) == pytest.approx(29.5e-3, rel=0.02)
    still = referred(np.zeros_like(slow.x))
    noise = slow.seen(still, 1e-4, np.random.default_rng(0)) - slow.seen(still, 0.0, np.random.default_rng(0))
    assert 1e-5 < noise[:, 0].std() < 3e-4


def test_a_shift_is_as_large_as_the_change_of_shape_and_at_its_times(log):
    _, cycles = recorded(load_dataset(log))
    shifts = np.array([cycles.shifting(np.random.default_rng(seed)) for seed in range(400)])
    by_time = np.sqrt(np.square(cycles.change).sum(axis=1) / 3.0)
    later = cycles.t > 2.0
    np.testing.assert_allclose(np.sqrt(np.square(shifts).mean(axis=(0, 2, 3)))[later], by_time[later], rtol=0.05)
    np.testing.assert_allclose(np.sqrt(np.square(shifts).mean(axis=(0, 1))), per_coordinate(cycles.change), rtol=0.15)


def test_a_shift_of_all_markers_alike_is_seen_as_a_motion_of_the_base(log):
    _, cycles = recorded(load_dataset(log))
    still, rng = np.zeros_like(cycles.x), np.random.default_rng(0)
    shift = np.zeros((len(cycles.t), 3, 3)) + [1e-4, -2e-4, 3e-4] * (cycles.t > 5.0)[:, None, None]
    seen = cycles.seen(still, 0.0, rng, shift)
    moved = [1e-4, -2e-4, 3e-4, 0.0, 0.0, 0.0]  # in the markers' axes, 0.3 mrad from those of frame 0
    np.testing.assert_allclose(seen[cycles.t > 6.0], np.tile(moved, ((cycles.t > 6.0).sum(), 1)), atol=1e-7)


def test_the_log_s_markers_do_not_keep_their_shape(log):
    slow, cycles = (per_coordinate(trial.change) for trial in recorded(load_dataset(log)))
    assert slow == pytest.approx(0.014e-3, rel=0.05) and cycles == pytest.approx(0.100e-3, rel=0.05)


def test_markers_err_upwards_as_they_do_sideways():
    """Three markers cannot say how far they shift across their plane; the shoulder's four can: as far as within it."""
    columns = [f"shoulder{k}_{a}" for k in (1, 2, 3, 4) for a in "xyz"]
    read = np.genfromtxt(LOG_FILE, delimiter=",", names=True, dtype=None, encoding=None, usecols=["time_utc", *columns])
    p = low_passed(even(_seconds(read["time_utc"]), np.stack([read[c] for c in columns], axis=1)), 5.0)
    rest, cycles = p.x[2200:2300].mean(axis=0).reshape(4, 3), p.x[2600:3300].reshape(-1, 4, 3)
    d = np.square(body_poses(rest, cycles).residual).sum(axis=1).mean(axis=0)
    up, sideways = np.sqrt(d[2] / 1.0), np.sqrt(d[:2].sum() / 5.0)
    assert 0.5 < up / sideways < 1.0 and sideways == pytest.approx(0.073e-3, rel=0.1)


def test_a_dataset_without_a_plate_is_reported(log):
    dataset = load_dataset(log)
    without = replace(dataset, description=dataset.description.model_copy(update={"trials": ()}))
    with pytest.raises(NotEnoughData, match="record both while the arm moves"):
        recorded(without)


def test_the_command_refuses_a_scenario_it_does_not_know(tmp_path, capsys):
    with pytest.raises(SystemExit) as left:
        main.main(["reality", "realty", "--out", str(tmp_path / "a.json")])
    assert left.value.code == 2 and "reality" in capsys.readouterr().err
    assert not (tmp_path / "a.json").exists()


def test_the_floor_feels_the_hand_s_inertia(log):
    """Newton: F = -m a along both horizontal axes. The log's column Fy says +m a, so the mapping reverses it."""
    columns = [f"gripper{k}_{a}" for k in (1, 2, 3) for a in "xy"]
    read = np.genfromtxt(LOG_FILE, delimiter=",", names=True, dtype=None, encoding=None, usecols=["time_utc", *columns])
    hand = np.stack([read[c] for c in columns], axis=1).reshape(-1, 3, 2).mean(axis=1)
    slow, cycles = (trial for _, trial in load_dataset(log).trials("calibration"))
    force = low_passed(even(cycles.t_plate, cycles.plate_wrench[:, 0, :2]), 2.5)
    path = low_passed(even(_seconds(read["time_utc"]), hand), 2.5)
    t = force.t - slow.t_plate[0]
    moving = (t > START - 0.4) & (t < t[-1] - 0.5)
    acceleration = CubicSpline(path.t, path.x)(t[moving], 2)
    for a, f in zip(acceleration.T, force.x[moving].T, strict=True):
        assert np.corrcoef(a, f)[0, 1] < -0.95 and -np.polyfit(a, f, 1)[0] == pytest.approx(5.7, abs=0.5)


def test_the_swings_turn_the_hand_as_the_log_did():
    """The angle from where it was at rest, which needs no place of the markers on the gripper; up to 0.8 rad."""
    columns = [f"gripper{k}_{a}" for k in (1, 2, 3) for a in "xyz"]
    markers = np.genfromtxt(
        LOG_FILE, delimiter=",", names=True, dtype=None, encoding=None, usecols=["time_utc", *columns]
    )
    t = _seconds(markers["time_utc"])
    x = np.stack([markers[c] for c in columns], axis=1).reshape(-1, 3, 3)
    x -= x.mean(axis=1, keepdims=True)
    rest, sample = x[(t > 22.5) & (t < 23.2)].mean(axis=0), np.flatnonzero(t > 24.0)[::20]
    turned = [Rotation.align_vectors(x[i], rest)[0].magnitude() for i in sample]
    model = mjcf.spec().compile()
    for path in AS_LOGGED:
        R = [_hand(model, q) for q in path.at(np.array([0.0, *(t[sample] - START)]))]
        np.testing.assert_allclose([(R[0].inv() * r).magnitude() for r in R[1:]], turned, atol=0.03)


def test_the_log_rolls_about_a_line_above_its_wheels(log):
    """y = a roll + Fy / k between the jerks: k is a floor's, a is 0.2 m; a base on upright springs has 0."""
    _, cycles = recorded(load_dataset(log))
    steady = cycles.t > 4.0
    x, w = (low_passed(Signal(cycles.t, v, np.ones(len(cycles.t), dtype=bool)), 1.5).x for v in (cycles.x, cycles.w))
    A = np.column_stack([np.ones(steady.sum()), x[steady, 3], w[steady, 1]])
    theta = np.linalg.lstsq(A, x[steady, 1])[0]
    assert theta[1] == pytest.approx(0.21, abs=0.02) and 1.0 / theta[2] == pytest.approx(84e3, rel=0.1)
    assert (x[steady, 1] - A @ theta).var() < 0.02 * x[steady, 1].var()


def _seconds(stamps):
    """Time of day since the first of the stamps [s]."""
    clock = np.array([s.split("_")[1].split(":") for s in stamps], dtype=float) @ [3600.0, 60.0, 1.0]
    return clock - clock[0]


def _hand(model, q):
    data = mujoco.MjData(model)
    for joint, value in zip(JOINTS, q, strict=True):
        data.joint(joint).qpos = value
    mujoco.mj_kinematics(model, data)
    return Rotation.from_matrix(data.body("gripper_grasping_frame").xmat.reshape(3, 3))


def test_the_swings_start_at_full_speed_under_the_joints_limits():
    model = mjcf.spec().compile()
    limits = np.array([model.joint(j).range for j in JOINTS])
    for path in AS_LOGGED:
        q = path.at(np.linspace(0.0, 1.0 / path.frequency[1], 200))
        assert (q > limits[:, 0]).all() and (q < limits[:, 1]).all() and not np.any(path.phase)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 20, 40])
def test_the_log_moves_among_the_draws(log, seed, claim):
    """As drawn y, roll, pitch and yaw; z, too, where markers shift as the log's; all where casters turn as well."""
    trials, scenario, less = recorded(load_dataset(log)), load("reality", [f"seed={seed}"]), set()
    for condition, cause in zip(ASKED, (AS_DRAWN, *CAUSES), strict=True):
        shares = dict(zip(AXES, compare_replay(scenario, trials, 20, cause).share, strict=True))
        for axis, share in shares.items():
            claim(f"reality/replay/{condition}/{axis}#{seed}", share)
        less |= {(condition, axis) for axis in ASKED[condition] if shares[axis] < 0.8}
    assert less == OPEN.get(seed, set())


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "inside"), [(0, 9), (20, 8), (40, 9)])
def test_figures_of_the_log_lie_among_the_draws(seed, inside, claim):
    """Nine of fourteen with the seeds of the widths' condition; the others are one short, as the page says."""
    found = compare_swings(load("reality", [f"seed={seed}"]), 20).n_inside
    claim(f"reality/inside/seeds {seed} to {seed + 19}", found)
    assert found >= inside
