"""Corrections are judged where they matter, and the report says where the printed model ends."""

from dataclasses import replace

import numpy as np
import pytest

from calibration import Dataset, Estimate
from calibration.evaluation.joint_regimes import residuals, validation_qualities
from calibration.mocap.postures import passed_rows
from calibration.numerics.signals import play
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.stages.joints import repetitions
from calibration.stages.joints.correction import JointModels, correct
from calibration.stages.joints.degree_selection import Candidate
from calibration.stages.joints.hand_selection import nearest_hand
from calibration.stages.joints.repetitions import on_repetitions
from calibration.stages.joints.samples import Samples
from calibration.stages.joints.stage import fit_joint_models
from tests.doubles import joint_data, rigid_robot
from tests.doubles.joint_data import ROBOT

ARM_6, ARM_7 = 6, 7
GAP = 12e-3


@pytest.fixture(scope="module")
def campaign(dataset: Dataset, estimate: Estimate, chain: Chain) -> tuple:
    """The small campaign's calibration trials, and its calibrated geometry."""
    hand = hand_of(estimate.model("model_2"), chain, nominal_frames(chain, dataset.description))
    return dataset.description, [t for _, t in dataset.trials("calibration")], estimate.clock("robot"), hand


def sampled(trial: Trial, y: np.ndarray) -> Samples:
    rows = np.arange(0, len(trial.t_robot), 10)
    q = trial.q_motor[rows]
    return Samples(trial.id, trial.t_robot[rows], q[:, ARM_6], 0.0 * q[:, 0], 0.0 * q[:, 0], y[rows])


def option(trials: list[Trial], lost: list[np.ndarray], joint: int, gain: float, degree: int = 1) -> Candidate:
    """A candidate that predicts `gain` times what play took from the joint."""
    left_out = tuple(gain * d[::10, joint] for d in lost)
    return Candidate(degree, ((0, 0),), left_out, 0.5)


def test_the_option_that_brings_the_hand_nearer_is_taken_and_a_harmful_one_is_not(campaign: tuple) -> None:
    description, trials, robot, hand = campaign
    gaps = np.array([0.0, 1.0, 1.0, 1.5, 1.5, 3.0, 12.0, 10.0]) * 1e-3
    lost = [t.q_motor - play(t.q_motor, gaps) for t in trials]
    names = ("arm_6_joint", "arm_7_joint")
    samples = {name: [sampled(t, t.q_motor[:, 0]) for t in trials] for name in names}
    good, half, bad = (option(trials, lost, ARM_6, g, k) for k, g in enumerate((1.0, 0.4, -1.0)))
    options = {"arm_6_joint": (bad, half, good), "arm_7_joint": (option(trials, lost, ARM_7, -1.0),)}
    chosen = nearest_hand(description, trials, robot, hand, samples, options)
    assert chosen == {"arm_6_joint": good}
    assert nearest_hand(description, trials, robot, hand, samples, options | {"arm_6_joint": ()}) == {}


def test_without_markers_the_lowest_degree_worth_trying_is_taken() -> None:
    data = joint_data.made([])
    one, two = (option(data, [t.q_motor for t in data], ARM_6, 1.0, k) for k in (1, 2))
    chosen = nearest_hand(joint_data.described(), data, ROBOT, joint_data.hand(), {}, {"arm_6_joint": (one, two)})
    assert chosen == {"arm_6_joint": one}


def on_validation(models, trials, robot):
    corrected = ((t, correct(models.of_trial(t.id), t.t_robot, t.q_motor)) for t in trials)
    return validation_qualities(models, [residuals(models, trial, c, robot) for trial, c in corrected])


def test_play_is_explained_in_motion_and_not_at_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(repetitions, "RICHEST", 2)
    rng = np.random.default_rng(2)
    moving = [*joint_data.motions(0), *joint_data.motions(9, 2)]
    static, dwells = rigid_robot.through(rng.uniform(-1.0, 1.0, (12, 8)) * 0.4 + rigid_robot.CENTRE)
    data = [joint_data.recorded(f"t{k}", q, lost_in_play(q)) for k, q in enumerate(moving)]
    rests = [joint_data.recorded(name, static[::5], lost_in_play(static[::5]), dwells) for name in ("a", "b")]
    calibration, validation = [*data[:-2], rests[0]], [*data[-2:], rests[1]]
    models, _ = fit_joint_models(joint_data.LAB, calibration, ROBOT, joint_data.hand())
    found = {x.regime: x for x in on_repetitions(models, calibration, "total") if x.joint == "arm_6_joint"}
    found |= {x.regime: x for x in on_validation(models, validation, ROBOT) if x.joint == "arm_6_joint"}
    assert found["repetition"].cut > 0.6
    assert found["repetition"].r2 > 0.85
    assert found["unseen_motion"].cut > 0.5
    assert found["static"].cut < 0.2
    assert found["static"].n == 12
    assert found["unseen_motion"].before == pytest.approx(GAP, rel=0.1)


def test_a_start_is_no_repetition_and_is_distinguished(monkeypatch: pytest.MonkeyPatch) -> None:
    """The gear is thrown from flank to flank for a second after each start, by nothing the model is asked with."""
    monkeypatch.setattr(repetitions, "RICHEST", 1)
    data = []
    for k, q in enumerate(joint_data.motions(0)):
        y = lost_in_play(q)
        thrown = slice(100, 230)
        y[thrown, ARM_6] = GAP * np.sign(np.sin(0.12 * np.arange(130) + k))
        data.append(joint_data.recorded(f"t{k}", q, y))
    still = np.repeat(rigid_robot.CENTRE[None], 400, axis=0)
    data.append(joint_data.recorded("rest", still, lost_in_play(still), np.array([[0.5, 3.5]])))
    models, _ = fit_joint_models(joint_data.LAB, data, ROBOT, joint_data.hand())
    found = {x.regime: x for x in on_repetitions(models, data, "total") if x.joint == "arm_6_joint"}
    assert found["repetition"].cut > 0.6
    assert found["start_stop"].cut < 0.3
    assert found["repetition"].entry() | {"joint": "", "regime": ""} == {
        "joint": "", "regime": "", "degree": found["repetition"].degree, "n": found["repetition"].n,
        "discrepancy_before_mrad": 1e3 * found["repetition"].before, "outside_percent": 0.0,
        "discrepancy_after_mrad": 1e3 * found["repetition"].after, "r2": found["repetition"].r2,
        "cut_percent": 100.0 * found["repetition"].cut,
    }  # fmt: skip


@pytest.mark.parametrize(("change", "reported"), [("nothing", True), ("one way", False), ("no play", False)])
def test_a_joint_is_excited_on_both_flanks_and_above_the_noise(
    monkeypatch: pytest.MonkeyPatch, change: str, reported: bool
) -> None:
    monkeypatch.setattr(repetitions, "RICHEST", 1)
    data = []
    for k, q in enumerate(joint_data.motions(0)):
        if change == "one way":
            q[:, ARM_6] = np.linspace(-0.5, 0.5, len(q))
        y = lost_in_play(q) * (2e-3 if change == "no play" else 1.0)
        data.append(joint_data.recorded(f"t{k}", q, y))
    models = JointModels(joint_data.inputs(), joint_data.ZERO, ())
    found = [x.joint for x in on_repetitions(models, data, "total") if x.regime == "repetition"]
    assert ("arm_6_joint" in found) == reported


def lost_in_play(q: np.ndarray) -> np.ndarray:
    y = np.zeros_like(q)
    y[:, ARM_6] = (q - play(q, np.full(8, GAP)))[:, ARM_6]
    return y


def test_regimes_leave_out_joints_that_are_not_excited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(repetitions, "RICHEST", 1)
    still = []
    for trial in joint_data.made([]):
        q = trial.q_motor.copy()
        q[:, ARM_7] = 0.1
        still.append(replace(trial, q_motor=q, q_link=q - joint_data.ZERO))
    models, _ = fit_joint_models(joint_data.LAB, still, ROBOT, joint_data.hand())
    reported = {x.joint for x in (*on_repetitions(models, still, "total"), *on_validation(models, still, ROBOT))}
    assert "arm_7_joint" not in reported
    assert "torso_lift_joint" not in reported


def test_samples_that_are_passed_end_where_the_trial_does():
    t = 536.174 + np.arange(5061) / 100.0  # the last of the regular times is beyond its end by rounding
    rows = passed_rows(t, 0.2)
    assert abs(rows[0] - 100) <= 1 and rows[-1] <= 5060 and (np.abs(np.diff(rows) - 20) <= 1).all()
