from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import mjcf
from calibration.checks.plates import by_scale
from calibration.inference.parameters import Model
from calibration.mocap.cluster_pose import poses_of
from calibration.numerics.lie import to_vector
from calibration.recording.clock import Clock
from calibration.robot.laboratory import Laboratory
from calibration.stages.suspension.base_response import laboratory
from calibration.stages.suspension.modal_response import modes_of
from calibration.stages.suspension.rest_frame import rest_of, upright
from calibration.stages.suspension.stage import fit_suspension
from calibration.stages.suspension.wheels import matrices, wheel_model
from tests.doubles import rigid_robot
from tests.doubles.moving_base import T_LAB_BASE, WHEELS, base_poses, moved, values

DESCRIPTION = rigid_robot.described(wheels=[w.model_dump() for w in WHEELS])
TRUTH = rigid_robot.Truth(marker_sigma=2e-6, encoder_quantum=0.0, robot=(0.0, 0.0), plate=(0.0, 0.0))
ROBOT, PLATE = (Clock(i, 0.0, 0.0, np.zeros((2, 2)), 0.0, 1e-4) for i in ("robot", "plate"))
K, C = matrices(wheel_model(WHEELS, "centre"), values(np.random.default_rng(7)))


def plated(trial, wrench):
    """The trial with another wrench (n, 6)."""
    return replace(trial, plate_wrench=wrench[:, None])


def record(name, joints, rng):
    """A trial whose base answers the plate's wrench, which is that of the arm alone."""
    amplitudes = np.zeros(8)
    amplitudes[joints] = 0.4
    motor = rigid_robot.swing(amplitudes, rng.uniform(0.3, 0.8, 8), 6.0)
    trial = rigid_robot.record(TRUTH, motor, 0.0, rng)
    t = np.arange(len(motor) // 5) / (rigid_robot.GRID / 5.0)
    w = rigid_robot.plate_wrench(TRUTH, motor[::5], T_LAB_BASE, rigid_robot.GRID / 5.0)[: len(t)]
    action = pin.SE3(T_LAB_BASE).dualAction
    w_0 = np.linalg.solve(action, w.T).T
    G = np.zeros((6, 6))  # the load that is there at rest turns with the base
    G[0, 4], G[1, 3], G[5, 3], G[5, 4] = w_0[0, 2], -w_0[0, 2], w_0[0, 4], -w_0[0, 3]
    x = modes_of(K + G, C, np.zeros((6, 6))).respond(w_0 - w_0[0], 5.0 / rigid_robot.GRID)
    clean = np.stack([np.interp(trial.t_plate, t, column) for column in w.T], axis=1)
    noisy = clean + 1e-2 * rng.normal(size=clean.shape)
    return plated(replace(moved(trial, x, t), id=name), noisy), x


@pytest.fixture(scope="module")
def recorded():
    rng = np.random.default_rng(11)
    plan = {"a": [1, 2], "b": [2, 3], "c": [1, 4], "d": [1, 3]}
    return {name: record(name, joints, rng) for name, joints in plan.items()}


@pytest.fixture(scope="module")
def trials(recorded):
    return tuple(trial for name, (trial, _) in recorded.items() if name != "d")


def fit(trials, plate=PLATE):
    return fit_suspension(Laboratory(mjcf.urdf(), DESCRIPTION), trials, ROBOT, plate)


@pytest.fixture(scope="module")
def fitted(trials):
    return fit(trials)


def said(verdicts, kind):
    return " | ".join(v.message for v in verdicts if v.verdict == kind)


def test_springs_come_back_from_recordings(fitted):
    suspension, verdicts = fitted
    q = np.sqrt(np.diag(K))
    error = np.abs(suspension.K - K) / np.outer(q, q)
    assert error[3:5, 3:5].max() < 0.02
    assert error.max() < 0.1
    assert "refused" not in {v.verdict for v in verdicts}
    assert suspension.gravity[3, 3] == pytest.approx(-270.0, rel=0.1)
    assert suspension.moves("plate")[3:5].all()


def test_the_base_is_predicted_from_the_wrench_and_the_first_second(fitted, recorded):
    trial, x = recorded["d"]
    lab = laboratory(mjcf.urdf(), DESCRIPTION, ROBOT, PLATE)
    body = DESCRIPTION.base_body
    blind = trial.marker_position.copy()
    blind[trial.t_mocap > 1.0] = np.nan
    T = base_poses(fitted[0], lab, replace(trial, marker_position=blind), "plate")
    error = to_vector(np.linalg.inv(poses_of(body, trial).T) @ T)
    motion = to_vector(np.linalg.inv(poses_of(body, trial).T) @ T[:1])
    assert (1.0 - (error**2).sum(axis=0) / (motion**2).sum(axis=0))[3:5].min() > 0.99
    assert T.shape == (len(trial.t_mocap), 4, 4)


def test_displacement_takes_any_sampling_of_the_wrench(fitted):
    suspension = fitted[0]
    t = np.linspace(0.0, 2.0, 137)
    w = np.outer(np.sin(np.pi * t) ** 2, [0.0, 0.0, -50.0, 20.0, 5.0, 0.0])
    x = suspension.displacement(t, w)
    finer = np.linspace(0.0, 2.0, 1001)
    w_finer = np.outer(np.sin(np.pi * finer) ** 2, [0.0, 0.0, -50.0, 20.0, 5.0, 0.0])
    y = suspension.displacement(finer, w_finer)
    again = np.stack([np.interp(t, finer, column) for column in y.T], axis=1)
    np.testing.assert_allclose(x[:, 3:5], again[:, 3:5], atol=2e-3 * np.abs(y[:, 3]).max())


def test_fitting_twice_gives_the_same_bits(trials, fitted):
    again = fit(trials)[0]
    np.testing.assert_array_equal(again.K, fitted[0].K)
    np.testing.assert_array_equal(again.C, fitted[0].C)


def test_without_a_plate_the_dynamics_take_its_place(trials):
    bare = [rigid_robot.without_plate(t) for t in trials]
    suspension, verdicts = fit(bare, None)
    assert "no force plate" in said(verdicts, "missing")
    assert [s for s, _ in suspension.held_out] == ["dynamics"]
    assert not suspension.moves("plate").any()


@pytest.mark.parametrize(
    ("change", "reported"),
    [
        (lambda w: -w, "plate sign: Fz"),
        (lambda w: w * [1, 1, 1, -1, 1, 1], "Mx mirror"),
        (lambda w: w * [1, -1, 1, 1, 1, 1], "Fy mirror"),
        (lambda w: w[:, [1, 0, 2, 4, 3, 5]] * [-1, 1, 1, -1, 1, 1], "rotated by"),
        (lambda w: 0.001 * w, "scale"),
    ],
    ids=["sign", "one axis", "Fy", "rotated", "unit"],
)
def test_a_wrong_plate_is_refused_by_name(trials, change, reported):
    suspension, verdicts = fit([plated(t, change(t.plate_wrench[:, 0])) for t in trials])
    assert suspension is None
    assert reported in said(verdicts, "refused")


def turned(trial, degrees):
    """The trial with its plate's axes turned about the vertical."""
    R = pin.exp3(np.array([0.0, 0.0, np.radians(degrees)]))
    return plated(trial, np.hstack([trial.plate_wrench[:, 0, :3] @ R.T, trial.plate_wrench[:, 0, 3:] @ R.T]))


def test_a_slightly_turned_plate_is_reported(trials):
    for degrees in (5.0, 8.0):
        assert f"rotated by {degrees:.0f}" in said(fit([turned(t, degrees) for t in trials])[1], "warning")


def springs_moved(trials, fitted, change):
    """By name of a spring: what a finding says it moved by, what it moved by, and its sigma."""
    suspension, verdicts = fit([change(t) for t in trials])
    model = Model("model_1", suspension.parameters)
    moved = max((by_scale(model, v.moves)[-1] for v in verdicts if v.moves), key=lambda d: sum(abs(x) for _, x in d))
    known, clean = ({p.name: p for p in s.parameters} for s in (suspension, fitted[0]))
    names = [n for n, _ in moved if n in clean and n.startswith("suspension.K")]
    return np.array([[dict(moved)[n], known[n].value - clean[n].value, known[n].sigma] for n in names])


@pytest.mark.parametrize("scale", [1.2, 1.1], ids=["doubtful", "within the tolerance of masses"])
def test_springs_may_be_off_by_the_scale_of_a_plate(trials, fitted, scale):
    x = springs_moved(trials, fitted, lambda t: plated(t, scale * t.plate_wrench[:, 0]))
    assert x[:, 0] @ x[:, 1] > 0.9 * np.linalg.norm(x[:, 0]) * np.linalg.norm(x[:, 1])
    assert np.linalg.norm(x[:, 0]) == pytest.approx(np.linalg.norm(x[:, 1]), rel=0.25)


@pytest.mark.parametrize("degrees", [-8.0, 15.0])
def test_springs_may_be_off_by_the_turn_of_a_doubtful_plate(trials, fitted, degrees):
    said, off, sigma = springs_moved(trials, fitted, lambda t: turned(t, degrees)).T
    assert (np.abs(off) <= 2.0 * np.hypot(said, sigma)).all(), "every spring is in its widened interval"
    assert (np.abs(said) <= np.abs(off) + 2.0 * sigma).all(), "and it is no wider than need be"


@pytest.mark.parametrize(("wheel", "share"), [(0, 1.0 / 6.0), (2, 1.0 / 6.0), (5, 0.12)])
def test_a_wheel_off_the_plate_is_named(trials, wheel, share):
    place = pin.SE3(T_LAB_BASE).act(np.array(WHEELS[wheel].contact))
    arm = place - np.array(DESCRIPTION.plates[0].centre)

    def without(w):
        force = np.zeros((len(w), 3))
        force[:, 2] = share * w[:, 2]
        return w - np.hstack([force, np.cross(arm, force)])

    _, verdicts = fit([plated(t, without(t.plate_wrench[:, 0])) for t in trials])
    assert f"as if {WHEELS[wheel].name} stood off the plate" in said(verdicts, "warning")


@pytest.mark.parametrize(("gain", "named"), [(1.3, True), (0.8, True), (1.06, False), (1.0, False)])
def test_an_arm_that_weighs_otherwise_than_its_description_says_is_named(trials, gain, named):
    def heavier(w):
        return w + (gain - 1.0) * (w - w[:100].mean(axis=0)) * [0.0, 0.0, 0.0, 1.0, 1.0, 0.0]

    _, verdicts = fit([plated(t, heavier(t.plate_wrench[:, 0])) for t in trials])
    warned = [v for v in verdicts if "the arm weighs" in v.message]
    assert bool(warned) is named
    if named:
        (((what, size),),) = warned[0].moves
        assert what == "links.masses" and size == pytest.approx(gain - 1.0, abs=0.05)


@pytest.mark.parametrize("which", [0, 1, 2])
def test_a_base_that_slips_about_the_vertical_in_one_trial_is_no_turned_plate(trials, which):
    some = [turned(t, 16.0) if k == which else t for k, t in enumerate(trials)]
    assert "rotated" not in said(fit(some)[1], "warning")


def test_a_base_that_was_pushed_is_reported_and_left_out(trials, fitted):
    late = trials[0].t_mocap > trials[0].t_mocap[-1] - 2.0
    position = trials[0].marker_position.copy()
    position[late] += [0.02, 0.01, 0.0]
    suspension, verdicts = fit((replace(trials[0], marker_position=position), *trials[1:]))
    assert "base moved during a by 22" in said(verdicts, "warning")
    assert suspension is not None
    assert {len(h.error) for _, h in suspension.held_out} == {len(trials) - 1}


def test_too_little_is_reported(trials):
    suspension, verdicts = fit(trials[:1])
    assert suspension is None
    assert "two trials" in said(verdicts, "missing")


def test_frame_0_stands_on_the_floor():
    tilted = T_LAB_BASE @ rigid_robot.se3(np.array([0.0, 0.0, 0.004, 0.01, -0.006, 0.0]))
    T = upright(tilted, DESCRIPTION)
    contacts = np.array([w.contact for w in WHEELS])
    np.testing.assert_allclose((contacts @ T[:3, :3].T + T[:3, 3])[:, 2], 0.0, atol=1e-12)
    assert np.linalg.norm(T[:2, 3] - tilted[:2, 3]) < 1e-4


def test_displacements_and_poses_are_a_round_trip(trials):
    rest = rest_of(DESCRIPTION, trials[0], rigid_robot.se3(np.array([0.01, 0.0, 0.02, 0.0, 0.01, 0.0])))
    x = 1e-2 * np.random.default_rng(0).normal(size=(5, 6))
    np.testing.assert_allclose(rest.displacement(rest.poses(x)), x, atol=1e-12)
