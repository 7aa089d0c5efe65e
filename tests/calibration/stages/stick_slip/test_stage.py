from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import mjcf
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.robot.laboratory import Laboratory
from calibration.stages.bundle.moved_base import moved_as_predicted
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.drive_trains.stage import MovedBase
from calibration.stages.drive_trains.torques import dynamics
from calibration.stages.stick_slip import fit_stick_slip, slipping_base_poses, stage, wrenches_of
from calibration.stages.stick_slip.fit import linear_where
from calibration.stages.stick_slip.forcing import Tilting, planar_forcing
from calibration.stages.stick_slip.poses import Arm, moving_links
from calibration.stages.stick_slip.stage import _behind, _judged, _misplaced
from calibration.stages.stick_slip.wheels import WIDE, SlipParameters, wheel_set
from calibration.stages.suspension.base_response import laboratory
from calibration.stages.suspension.cross_validation import HeldOut
from calibration.stages.suspension.modal_response import modes_of
from calibration.stages.suspension.model import Suspension
from calibration.stages.suspension.rest_frame import rest_of
from tests.doubles import rigid_robot
from tests.doubles.moving_base import T_LAB_BASE, WHEELS, moved

DESCRIPTION = rigid_robot.described(wheels=[w.model_dump() for w in WHEELS])
RECORDED = rigid_robot.Truth(marker_sigma=1e-5, encoder_quantum=0.0, robot=(0.0, 0.0), plate=(0.0, 0.0))
ROBOT, PLATE = (Clock(i, 0.0, 0.0, np.zeros((2, 2)), 0.0, 1e-4) for i in ("robot", "plate"))
STUCK = SlipParameters(5e3, 9e3, 12e3, 20e3, 9.0, 9.0, 9.0, 100.0, 80.0, 1.0, 0.1, 1.0, 1.0)


def stiffness():
    """K and C (6, 6): the wheels in the plane, and a soft tilt."""
    K, plane = np.diag([1.0, 1.0, 9e5, 2e4, 2e4, 1.0]), [0, 1, 5]
    K[np.ix_(plane, plane)] = wheel_set(mjcf.urdf(), WHEELS, 9.81).stiffness(STUCK)
    return K, 0.006 * K


def record(name, joints, rng):
    """A trial of a base that answers the arm's wrench without inertia and without slip."""
    amplitudes = np.zeros(8)
    amplitudes[joints] = 0.12
    motor = rigid_robot.swing(amplitudes, rng.uniform(0.3, 0.6, 8), 6.0)
    trial = rigid_robot.record(RECORDED, motor, 0.0, rng)
    t = np.arange(len(motor) // 5) / (rigid_robot.GRID / 5.0)
    w = rigid_robot.plate_wrench(RECORDED, motor[::5], T_LAB_BASE, rigid_robot.GRID / 5.0)[: len(t)]
    w_0 = np.linalg.solve(pin.SE3(T_LAB_BASE).dualAction, w.T).T
    K, C = stiffness()
    G = np.zeros((6, 6))
    G[0, 4], G[1, 3] = w_0[0, 2], -w_0[0, 2]
    x = modes_of(K + G, C, np.zeros((6, 6))).respond(w_0 - w_0[0], 5.0 / rigid_robot.GRID)
    clean = np.stack([np.interp(trial.t_plate, t, column) for column in w.T], axis=1)
    return replace(moved(trial, x, t), id=name, plate_wrench=clean[:, None]), x, t


@pytest.fixture(scope="module")
def recorded():
    rng = np.random.default_rng(1)
    return [record(name, joints, rng) for name, joints in {"a": [1, 2], "b": [1, 3], "c": [1, 4], "d": [1, 2]}.items()]


@pytest.fixture(scope="module")
def suspension():
    K, C = stiffness()
    none, sums = np.zeros((6, 6)), np.ones((3, 6))
    tried = HeldOut(1e-6 * sums, 1e-6 * sums, 1e-12 * sums, np.ones(3))
    return Suspension("compliance", K, C, none, none, (("plate", tried),), (), ())


def fit(trials, suspension, robot=ROBOT, plate=PLATE, description=DESCRIPTION):
    model, _, said = fit_stick_slip(laboratory(mjcf.urdf(), description, robot, plate), trials, suspension)
    return model, said


def test_without_joints_the_plate_alone_moves_the_base(recorded, suspension):
    model, said = fit([r[0] for r in recorded[:3]], suspension, robot=None)
    assert [d.source for d in model.directions] == ["plate"] and said[0].verdict == "ok"
    assert model.directions[0].held_out.r2[2] > 0.9
    new, x, t = recorded[3]
    lab = laboratory(mjcf.urdf(), DESCRIPTION, None, PLATE)
    found = slipping_base_poses(model, lab, new, "plate")
    true = np.interp(new.t_mocap, t, x[:, 5])
    heading = np.arctan2(found.T_lab_B[:, 1, 0], found.T_lab_B[:, 0, 0])
    error = heading - heading[:50].mean() - true
    assert (error**2).sum() < 0.1 * (true**2).sum()
    assert found.motion.variance.shape == (len(new.t_mocap), 6)


def test_inverse_dynamics_carry_the_payload_of_the_trial(recorded):
    """2 kg in place of 0.4 in a trial for calibration weigh on the floor and in the inertia."""
    trial = recorded[0][0]
    entry = {"id": trial.id, "role": "calibration", "kind": "swing", "motion": "a", "file": "a.nc", "sha256": "0" * 64}
    payload = {"link": "gripper_grasping_frame", "mass": 0.4, "com": [0.0, 0.0, 0.0], "tolerance": 0.1}

    def found(**own):
        data = rigid_robot.description([{**entry, **own}], payload=payload, wheels=[w.model_dump() for w in WHEELS])
        sources = laboratory(mjcf.urdf(), Description.model_validate(data), ROBOT, PLATE)
        wrenches = wrenches_of(sources, trial, T_LAB_BASE)
        floor = sources.dynamics_load(trial, T_LAB_BASE).signal.x[:, 2].mean()
        return floor, wrenches.dynamics.signal.x[:, 2].mean(), -9.81 * wrenches.M[0, 0, 0]

    for light, heavy in zip(found(), found(payload=2.0), strict=True):
        assert heavy - light == pytest.approx(-1.6 * 9.81, rel=0.02)  # the arm swings


def test_the_load_counts_from_where_the_plate_seems_to_be(recorded):
    sources = laboratory(mjcf.urdf(), DESCRIPTION, ROBOT, PLATE)
    one, off = wrenches_of(sources, recorded[0][0], T_LAB_BASE), np.array([6e-3, -9e-3])
    w = one.plate.signal.x.copy()
    w[:, 3] += w[:, 2] * off[1]
    w[:, 4] -= w[:, 2] * off[0]
    shifted = replace(one, plate=replace(one.plate, signal=replace(one.plate.signal, x=w)))
    stiff = Tilting(np.diag(np.full(6, 1e9)), np.diag(np.full(6, 1e7)))
    true, seen, corrected = (
        planar_forcing(wrench, replace(stiff, off=of), "plate").drive[:, 3:6]
        for wrench, of in ((one, np.zeros(2)), (shifted, np.zeros(2)), (shifted, off))
    )
    np.testing.assert_allclose(corrected, true, atol=1e-6)
    assert np.abs(seen - true).max() > 5.0


def test_wheels_slip_where_markers_have_the_base(recorded, suspension, monkeypatch):
    off = np.array([2e-3, -1e-3])
    monkeypatch.setattr(stage, "tilting_of", lambda *_: (Tilting(suspension.K, suspension.C, off), WIDE))
    sources = laboratory(mjcf.urdf(), DESCRIPTION, None, PLATE)
    found = stage.campaign_of(sources, [r[0] for r in recorded[:2]], suspension)
    for wheels in (found.wheels, found.by_source[0][2].wheels):
        np.testing.assert_array_equal(wheels.shift, off)


def test_a_base_that_was_moved_is_named(recorded, suspension):
    trials = [r[0] for r in recorded[:3]]
    position = trials[1].marker_position.copy()
    position[len(position) // 2 :] += [0.03, 0.0, 0.0]
    trials[1] = replace(trials[1], marker_position=position)
    _, said = fit(trials, suspension, robot=None)
    assert [v.message.split(":")[0] for v in said if "was it moved" in v.message] == ["b"]


def test_axes_that_the_compliance_predicts_better_are_linear(recorded, suspension):
    sums = np.ones((3, 6))
    ids = tuple(r[0].id for r in recorded[:3])
    better = (("plate", HeldOut(1e-14 * sums, 1e-6 * sums, 0.0 * sums, np.ones(3), ids)),)
    model, said = fit([r[0] for r in recorded[:3]], replace(suspension, held_out=better), robot=None)
    assert model.directions[0].linear.all() and "linear" in said[0].message


def test_an_axis_that_is_linear_from_dynamics_alone_speaks_against_no_plate(recorded, suspension):
    (plate,) = fit([r[0] for r in recorded[:3]], suspension, robot=None)[0].directions
    half = replace(plate, held_out=replace(plate.held_out, error=0.5 * plate.held_out.motion))
    assert not _behind((half, replace(half, linear=np.array([True, False, False]))))
    assert _behind((half, plate)) == ["x", "y", "yaw"]


@pytest.mark.parametrize(
    ("yaw", "y", "behind"), [(0.95, 0.7, []), (0.95, 0.5, ["y"]), (0.6, 0.7, ["y"]), (0.6, 0.85, [])]
)
def test_an_axis_of_few_trials_speaks_against_no_plate_that_explains_yaw(recorded, suspension, yaw, y, behind):
    (plate,) = fit([r[0] for r in recorded[:3]], suspension, robot=None)[0].directions
    motion = 1e-6 * np.ones((8, 3))

    def explaining(*r2):
        return replace(plate, held_out=HeldOut((1.0 - np.array(r2)) * motion, motion, 1e-12 * motion, np.ones(8)))

    assert _behind((explaining(0.9, y, yaw), explaining(0.9, 0.9, 0.65))) == behind


def test_where_no_wheel_slides_slip_explains_yaw_alone(recorded, suspension):
    """An anchored base: a valley of the fit predicts yaw better than springs do, and slips along x that nobody saw."""
    (direction,) = fit([r[0] for r in recorded[:3]], suspension, robot=None)[0].directions
    sums, yaw = np.ones((8, 6)), np.arange(6) == 5

    def linear(of_yaw, along, used="abcdefgh"):
        left, n = np.where(yaw, of_yaw, 0.2e-6) * sums, len(used)
        seen = HeldOut(left[:n], 1e-6 * sums[:n], 1e-10 * sums[:n], np.ones(n), tuple(used))
        own = np.repeat([[along, 0.1e-6, 0.1e-6]], 8, axis=0)
        known = HeldOut(own, 1e-6 * sums[:, :3], 1e-10 * sums[:, :3], np.ones(8), tuple("abcdefgh"))
        return linear_where(replace(direction, held_out=known), replace(suspension, held_out=(("plate", seen),))).linear

    assert linear(of_yaw=0.2e-6, along=10e-6).all()
    assert not linear(of_yaw=0.2e-6, along=0.5e-6).any()  # springs leave less along x, and more of all three
    assert not linear(of_yaw=0.7e-6, along=1e-4).any()  # they hardly explain yaw: wheels yield otherwise
    assert linear(of_yaw=0.2e-6, along=3e-6).all()
    assert not linear(of_yaw=0.2e-6, along=3e-6, used="abcd").any()  # after the others it rested elsewhere


def test_a_trial_that_alone_turns_the_base_says_as_much_of_sliding_as_all_others(recorded, suspension):
    (direction,) = fit([r[0] for r in recorded[:3]], suspension, robot=None)[0].directions
    names, motion = tuple("abcdefgh"), np.append(20.0, np.ones(7))[:, None] * 1e-6 * np.ones((8, 6))

    def linear(of_far, of_others):
        seen = HeldOut(0.2 * motion, motion, 1e-10 * np.ones((8, 6)), np.ones(8), names)
        own = np.append(of_far, np.repeat(of_others, 7))[:, None] * motion[:, :3]
        known = HeldOut(own, motion[:, :3], 1e-10 * np.ones((8, 3)), np.ones(8), names)
        return linear_where(replace(direction, held_out=known), replace(suspension, held_out=(("plate", seen),))).linear

    assert not linear(of_far=1.0, of_others=0.02).any()  # without it slip is not known, and explains what is left
    assert linear(of_far=50.0, of_others=0.2).all() and linear(of_far=50.0, of_others=0.02).all()


def test_a_trial_that_slipped_too_far_decides_nothing(recorded, suspension):
    """One wild trial of eight would make a good prediction look worse than a base at rest."""
    (direction,) = fit([r[0] for r in recorded[:3]], suspension, robot=None)[0].directions
    sums = np.ones((8, 3))
    error = 1e-8 * sums
    calm = HeldOut(error, 1e-6 * sums, 1e-10 * sums, np.full(8, 100.0))
    wild = replace(calm, error=np.concatenate([error[:7], 1e-4 * sums[:1]]))
    assert not wild.moves.any() and wild.wild.tolist() == [False] * 7 + [True]
    assert replace(direction, held_out=calm).moved.all() and replace(direction, held_out=wild).moved.all()


def test_a_trial_that_alone_turns_the_base_does_not_decide_by_how_others_predict_it(recorded, suspension):
    (direction,) = fit([r[0] for r in recorded[:3]], suspension, robot=None)[0].directions
    sums, names = np.ones((8, 3)), [f"trial {k}" for k in range(8)]

    def judged(far, of_far, of_others):
        motion = np.append(far, np.ones(7))[:, None] * 1e-6 * sums
        error = np.append(of_far * far, of_others * np.ones(7))[:, None] * 1e-6 * sums
        return _judged(replace(direction, held_out=HeldOut(error, motion, 1e-10 * sums, np.ones(8))), names)

    alone = judged(far=20.0, of_far=0.4, of_others=0.01)
    assert alone.verdict == "ok" and "yaw 0.70; yaw 0.99 without trial 0" in alone.message
    assert "without" not in judged(far=20.0, of_far=0.1, of_others=0.01).message
    for far, of_far, of_others in ((20.0, 0.3, 0.3), (5.0, 0.6, 0.01)):  # nor others; others turn it, too
        said = judged(far, of_far, of_others)
        assert said.verdict == "warning" and "check the wheels' declared places" in said.message


def test_what_is_missing_is_named(recorded, suspension):
    trials = [r[0] for r in recorded[:2]]
    model, said = fit(trials, suspension, description=DESCRIPTION.model_copy(update={"wheels": ()}))
    assert model is None and "wheels" in said[0].message and said[0].verdict == "missing"
    model, said = fit(trials, suspension, robot=None, plate=None)
    assert model is None and "two trials" in said[0].message
    model, said = fit(trials[:1], suspension)
    assert model is None


def test_trials_that_contradict_the_wheels_are_named(recorded, suspension):
    """Forces along the floor and the moment about the vertical are those of another time: they correct nothing."""

    def of_another_time(w):
        return np.where([True, True, False, False, False, True], np.roll(w, len(w) // 3, axis=0), w)

    model, said = fit([replace(r[0], plate_wrench=of_another_time(r[0].plate_wrench)) for r in recorded], suspension)
    assert [d.source for d in model.directions] == ["plate", "dynamics"]
    assert said[0].verdict == "warning" and "plate's axes" in said[0].message
    assert "does not correct it" in said[0].message and not model.directions[0].corrected


def test_a_wheel_that_seems_elsewhere_is_named_with_its_shift():
    shift, gain = np.zeros((3, 2)), np.array([5.0, 40.0, 3.0])
    shift[0, 0], shift[1, 1], shift[2] = 0.012, -0.02, 0.008
    (found,) = _misplaced(("left", "right", "front"), shift, gain)
    assert found.verdict == "warning" and "as if right stood +0 mm along x, -20 mm along y" in found.message
    assert not list(_misplaced(("left", "right", "front"), 0.4 * shift, gain))
    assert not list(_misplaced(("left", "right", "front"), shift, 0.05 * gain))
    (found,) = _misplaced(("left", "right", "front"), shift, np.array([30.0, 40.0, 3.0]))
    assert "y, or left stood +12 mm along x" in found.message and "front" not in found.message


def test_a_base_moves_slowly_as_its_markers_show_it_and_fast_as_its_wrench_does(recorded, suspension):
    """What loads the links: 9 Hz that only the markers show are noise, a fifth of a hertz is motion."""
    shaken, slow, fast = [], 1e-3, 3e-4
    for trial, _, _ in recorded[:3]:
        t = trial.t_mocap
        more = np.zeros((len(t), 6))
        more[:, 0] = fast * np.sin(2.0 * np.pi * 9.0 * t)
        more[:, 1] = slow * np.sin(2.0 * np.pi * 0.2 * t) * (t > t[0] + 1.0)
        shaken.append(moved(trial, more, t))
    sources = laboratory(mjcf.urdf(), DESCRIPTION, ROBOT, PLATE)
    (found, rough), (trial, x, t) = moved_as_predicted(sources, shaken, suspension), recorded[0]
    rest = rest_of(DESCRIPTION, shaken[0], sources.T_base_B)
    at, true = rest.displacement(found[trial.id].T_lab_B), np.interp(trial.t_mocap, t, x[:, 0])
    middle = (trial.t_mocap > t[0] + 1.5) & (trial.t_mocap < t[-1] - 0.5)
    assert np.std((at[:, 0] - true)[middle]) < 0.3 * fast / np.sqrt(2.0)
    drift = at[:, 1] - np.interp(trial.t_mocap, t, x[:, 1])
    wave = slow * np.sin(2.0 * np.pi * 0.2 * trial.t_mocap)
    assert np.std((drift - wave)[middle]) < 0.15 * slow / np.sqrt(2.0)
    none = replace(sources, lab=Laboratory(mjcf.urdf(), rigid_robot.described()))
    assert all(one.by_plate for one in found.values())
    assert rough is not None and moved_as_predicted(none, shaken, suspension) == ({}, None)


def test_links_move_with_the_base_as_it_is_predicted(recorded):
    """A base that sways, in its markers or by prediction."""
    trial, sources = recorded[0][0], laboratory(mjcf.urdf(), DESCRIPTION, ROBOT, PLATE)
    seen, x = MeasuredTrial.of(DESCRIPTION, trial), np.zeros((len(trial.t_mocap), 6))
    x[:, 5] = 0.05 * np.sin(2.0 * np.pi * trial.t_mocap) * (trial.t_mocap > trial.t_mocap[0] + 1.0)
    swaying = MeasuredTrial.of(DESCRIPTION, moved(trial, x, trial.t_mocap))
    rest = rest_of(DESCRIPTION, seen, sources.T_base_B)
    robot = dynamics(mjcf.urdf(), DESCRIPTION, np.zeros(len(DESCRIPTION.joint_names)))
    bare = DriveTrains(robot, (), mjcf.urdf(), DESCRIPTION)
    still, by_markers, predicted = (
        moving_links(sources.lab, Arm(bare, T), ROBOT, of, rest).signal.x
        for of, T in ((seen, {}), (swaying, {}), (seen, {trial.id: MovedBase(swaying.base.T, by_plate=True)}))
    )
    np.testing.assert_array_equal(predicted, by_markers)
    assert np.abs(predicted - still).max() > 0.5
