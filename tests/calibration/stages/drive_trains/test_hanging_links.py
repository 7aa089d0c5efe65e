"""Weight acts on links where they are, not where their motors are: against Pinocchio and against what must balance."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import mjcf
from calibration.recording.trial import Trial
from calibration.stages.drive_trains import DriveTrain, DriveTrains, stage, stream_of
from calibration.stages.drive_trains.torques import Dynamics
from tests.calibration.stages.drive_trains.test_coupled_links import URDF
from tests.doubles import joint_data, rigid_robot

SOFT = np.array([0.0, 5e-3, 0.0, 0.5, 1e-3, 0.0, 0.0])  # neither gap nor Coulomb friction
T = 0.01 * np.arange(400)


def robot() -> Dynamics:
    """Two links in a vertical plane."""
    model = pin.buildModelFromXML(URDF, pin.JointModelFreeFlyer())
    model.gravity = pin.Motion.Zero()
    return Dynamics(model, ("first", "second"), np.zeros(2), np.array([0.0, -9.81, 0.0]))


def held(q: np.ndarray) -> np.ndarray:
    """Torques (2,) that hold links at angles (2,)."""
    model = pin.buildModelFromXML(URDF)
    model.gravity = pin.Motion(np.array([0.0, -9.81, 0.0]), np.zeros(3))
    return np.asarray(pin.computeGeneralizedGravity(model, model.createData(), q))


def test_a_soft_arm_hangs_where_torques_at_its_links_balance_it() -> None:
    of = DriveTrains(robot(), tuple(DriveTrain(j, "dead_zone", SOFT) for j in ("first", "second")), "", None)  # type: ignore[arg-type]
    q, links = np.array([-0.9, -0.4]), np.array([-0.9, -0.4])
    for _ in range(60):
        links = q - SOFT[1] * held(links)
    assert 0.02 < (q - links)[0] < 0.06
    at_motors = np.abs(q - SOFT[1] * held(q) - links)
    loads = of.dynamics.loads("", T, np.tile(q, (len(T), 1)))
    along = of.of_loads(loads)
    assert (along.q == of.likely(loads)).all()
    resting = np.abs(np.concatenate([x[[0, -1]] for x in (along.q, along.low, along.high)]) - links)
    assert at_motors.min() > 1e-4 and (resting < 0.1 * at_motors).all(), (at_motors, resting)
    state, found = stream_of(of).begin(0.0, np.array([q, np.zeros(2), np.zeros(2)]))
    assert (np.abs(found.q[0] - links) < 0.1 * at_motors).all() and state.torque.shape == (1, 2)


def test_a_joint_bears_what_the_other_links_weigh_and_do_behind_their_motors() -> None:
    phase = 2.0 * np.pi * 1.5 * T
    q = np.column_stack([0.4 * np.sin(phase), 0.3 * np.cos(phase)])
    delta = np.column_stack([2e-4 * np.sin(3.0 * phase), 3e-4 * np.cos(2.0 * phase)])
    loads = robot().loads("", T, q)
    links = robot().loads("", T, q - delta)
    own = np.einsum("nii,ni->ni", links.inertia[:, :2, :2], loads.a - links.a)  # its own acceleration is its motor's
    inner, off = slice(50, -50), np.abs(loads.torque - links.torque - own)
    left = np.abs(loads.behind(delta).torque - links.torque - own)[inner]
    assert left.max() < 0.1 * off[inner].max(axis=0).min(), (left.max(axis=0), off[inner].max(axis=0))


def test_torques_about_other_positions_are_right_there() -> None:
    q, still = np.array([[0.3, -0.7]]), np.zeros((1, 2))
    delta = np.array([[0.02, -0.03]])
    torque, _, _, _, G, _ = robot().evaluated(q, still, still, None, delta=delta)
    np.testing.assert_allclose(torque[0] - G[0, :2, :2] @ delta[0], held((q - delta)[0]), rtol=1e-12)
    plain, *_ = robot().evaluated(q, still, still, None)
    assert np.abs(plain[0] - held(q[0])).max() < 1e-12


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_the_middle_of_a_gap_is_found_however_long_a_link_rests_on_either_flank(share: float) -> None:
    half, zero = 12e-3, 0.106
    trial = rigid_robot.record(rigid_robot.defects(0), rigid_robot.sweep(6, seconds=5.0), 0.0, np.random.default_rng(0))
    n = len(trial.t_robot)
    q = np.zeros((n, len(rigid_robot.JOINTS)))
    y = np.where(np.arange(n) < share * n, half, -half) + zero
    link = np.full(q.shape, np.nan)
    link[:, 6] = q[:, 6] - y
    seen = replace(trial, q_motor=q, q_link=link)
    middle = stage._ends([seen], len(rigid_robot.JOINTS)).mean(axis=0)
    assert middle[6] == pytest.approx(zero, abs=1e-12) and np.isnan(np.delete(middle, 6)).all()
    np.testing.assert_allclose(np.abs(stage._by_links(seen, middle).q_motor[:, 6]), half, atol=1e-12)
    assert (stage._by_links(seen, middle).q_motor[:, :6] == 0.0).all()


def test_drive_trains_are_fitted_to_links_where_their_encoders_read_them(monkeypatch: pytest.MonkeyPatch) -> None:
    rng, used = np.random.default_rng(1), {}
    motor, dwells = rigid_robot.through(rigid_robot.random_angles(rng, 4))
    trial = rigid_robot.record(rigid_robot.Truth(), motor, 0.0, rng, dwells)
    behind = np.zeros(trial.q_motor.shape)
    behind[:, 6] = 12e-3 * np.sign(np.arange(len(behind)) - 0.7 * len(behind))
    trial = replace(trial, q_link=trial.q_motor - behind - 0.1)
    monkeypatch.setattr(stage, "_identified", lambda bare, loads, differences, hand: used.update(loads=loads) or {})
    weighed: list[Trial] = []
    monkeypatch.setattr(stage, "hung_load", lambda urdf, described, offset, trials: weighed.extend(trials))
    described = rigid_robot.described()
    _, _, loads = stage.fit_drive_trains(mjcf.urdf(), described, [trial], joint_data.ROBOT, joint_data.hand())
    rows = np.isfinite(trial.q_motor).all(axis=1)
    expected = loads[trial.id].behind(behind[rows]).torque
    np.testing.assert_allclose(used["loads"][0].torque, expected, atol=1e-9)
    assert np.abs(expected - loads[trial.id].torque).max() > 0.01
    np.testing.assert_allclose(weighed[0].q_motor, trial.q_motor - behind, atol=1e-12)


def test_a_hole_in_link_readings_or_a_false_one_moves_no_link() -> None:
    t, rng = 0.01 * np.arange(300), np.random.default_rng(0)
    y = np.column_stack([np.where(t < 2.0, 5e-3, -5e-3) + 0.1, np.full(300, np.nan)])
    ends = np.array([[0.095, np.nan], [0.105, np.nan]])
    broken = y.copy()
    broken[rng.choice(180, 40, replace=False), 0] = np.nan
    np.testing.assert_allclose(
        stage._behind(t, broken, ends), np.column_stack([y[:, 0] - 0.1, np.zeros(300)]), atol=1e-12
    )
    broken = y.copy()
    broken[50, 0] = 3.0
    off = stage._behind(t, broken, ends) - stage._behind(t, y, ends)
    assert off[50, 0] == pytest.approx(5e-3) and (np.delete(off, 50, axis=0) == 0.0).all()


def test_without_trials_there_is_no_drive_train_and_a_message() -> None:
    described = rigid_robot.described()
    found, verdicts, loads = stage.fit_drive_trains(mjcf.urdf(), described, [], joint_data.ROBOT, joint_data.hand())
    assert not found.trains and not loads and [v.verdict for v in verdicts] == ["missing"]
