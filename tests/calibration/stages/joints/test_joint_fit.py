"""The stage: truth from data made by the equations, zeros, degrees, vertical axes, missing encoders."""

from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.laboratory import Laboratory
from calibration.stages.joints.correction import correct, input_model
from calibration.stages.joints.degree_selection import candidates, fit_joint, worthwhile
from calibration.stages.joints.model import JointModel
from calibration.stages.joints.samples import aligned_link_readings, link_zeros, samples_of
from calibration.stages.joints.stage import fit_joint_models
from tests.doubles import joint_data, rigid_robot
from tests.doubles.joint_data import OFFSET, ROBOT, ZERO

ARM_3, ARM_6 = 3, 6


@pytest.fixture(scope="module")
def truths() -> list[JointModel]:
    return [
        joint_data.truth("arm_3_joint", "total", 2, 20.0, 1),
        joint_data.truth("arm_6_joint", "total", 1, 60.0, 2),
    ]


@pytest.fixture(scope="module")
def trials(truths: list[JointModel]) -> list[Trial]:
    return joint_data.made(truths)


def fitted(trials: list[Trial]) -> tuple:
    return fit_joint_models(joint_data.LAB, trials, ROBOT, joint_data.hand())


@pytest.fixture(scope="module")
def stage(trials: list[Trial]) -> tuple:
    return fitted(trials)


@pytest.mark.parametrize("terms", ["printed", "tensor", "total"])
def test_noise_free_data_of_the_equations_give_them_back(terms: str) -> None:
    truth = joint_data.truth("arm_6_joint", terms, 2, 25.0, 5)  # type: ignore[arg-type]
    data = joint_data.made([truth])[:-1]
    samples = [samples_of(joint_data.inputs(), trial, ZERO)[ARM_6] for trial in data]
    chosen = next(c for c in candidates(samples, terms) if c.degree == 2)  # type: ignore[arg-type, arg-type]
    found = fit_joint("arm_6_joint", samples, 0.02, terms, chosen)  # type: ignore[arg-type]
    assert found.powers == truth.powers
    assert found.rho == pytest.approx(25.0, rel=1e-6)
    size = np.array([1e-3 * 10.0**-j for _, j in truth.powers])
    np.testing.assert_allclose(found.A / size, truth.A / size, atol=1e-6)
    np.testing.assert_allclose(found.B / size, truth.B / size, atol=1e-6)
    assert found.quality.r2 == pytest.approx(1.0, abs=1e-12)
    assert found.quality.residual < 1e-12


def test_the_stage_finds_degree_rho_and_zeros(stage: tuple, truths: list[JointModel]) -> None:
    models, _ = stage
    for truth in truths:
        found = models.model(truth.joint)
        assert found.degree == truth.degree
        assert found.rho == pytest.approx(truth.rho, rel=1e-4)
        assert found.quality.r2_out > 0.99
    at_rest = joint_data.discrepancies(truths, np.repeat(rigid_robot.CENTRE[None], 200, axis=0))[0]
    np.testing.assert_allclose(models.zero, ZERO + at_rest, atol=1e-12)


def test_correcting_gives_the_aligned_link_readings(stage: tuple, trials: list[Trial]) -> None:
    models, _ = stage
    trial = trials[2]
    found = correct(models, trial.t_robot, trial.q_motor)
    np.testing.assert_allclose(found.q, aligned_link_readings(trial, models.zero), atol=2e-7)
    assert found.outside.mean(axis=0).max() < 0.01  # between the samples that were kept


def test_correcting_is_pure_and_asks_encoders_alone(stage: tuple, trials: list[Trial]) -> None:
    models, _ = stage
    trial = trials[1]
    before = trial.q_motor.copy()
    one, two = (correct(models, t, trial.q_motor) for t in (trial.t_robot, trial.t_robot + 77.0))
    np.testing.assert_array_equal(trial.q_motor, before)
    np.testing.assert_allclose(one.q, two.q, atol=1e-9)
    again = correct(models, trial.t_robot, trial.q_motor)
    np.testing.assert_array_equal(one.q, again.q)
    still = correct(models, np.zeros(1), trial.q_motor[:1], np.zeros((1, 8)))
    assert still.q.shape == (1, 8)


def test_outside_the_domain_is_flagged_by_share(stage: tuple, trials: list[Trial]) -> None:
    models, _ = stage
    q = trials[0].q_motor.copy()
    q[: len(q) // 4, ARM_6] += 4.0
    found = correct(models, trials[0].t_robot, q)
    assert found.outside[:, ARM_6].mean() == pytest.approx(0.25, abs=0.01)
    assert found.outside[:, 1].mean() == 0.0


def test_torque_is_that_of_angles_not_of_readings() -> None:
    asked, q = joint_data.inputs(), rigid_robot.CENTRE[None]
    found = asked.inputs(np.zeros(1), q + OFFSET, np.zeros((1, 8)))
    np.testing.assert_allclose(found.theta, q, atol=1e-15)
    raw = replace(asked, offset=np.zeros(8)).inputs(np.zeros(1), q + OFFSET, np.zeros((1, 8)))
    assert abs(found.tau - raw.tau)[0, 2:].max() > 0.04  # [N.m] of a few
    assert abs(found.tau[0, 1]) < 1e-9  # the axis of arm_1 is vertical


def test_a_vertical_axis_loses_its_torque_terms_by_name(truths: list[JointModel]) -> None:
    truth = joint_data.truth("arm_1_joint", "total", 1, 20.0, 3)
    models, verdicts = fitted(joint_data.made([truth]))
    found = models.model("arm_1_joint")
    assert (found.degree, found.powers, found.dropped) == (1, ((0, 0), (1, 0)), ((0, 1),))
    assert any("arm_1_joint" in v.message and "A_01, B_01" in v.message for v in verdicts)


def test_pure_noise_is_not_corrected() -> None:
    rng = np.random.default_rng(4)
    data = [t for t in joint_data.made([]) if t.id != "rest"]
    for seed in range(3):
        noisy = [replace(t, q_link=t.q_motor - ZERO + 1e-3 * rng.normal(size=t.q_motor.shape)) for t in data]
        samples = [samples_of(joint_data.inputs(), t, ZERO)[ARM_3] for t in noisy]
        assert worthwhile(candidates(samples, "total")) == (), seed  # type: ignore[arg-type]


def test_a_joint_that_never_moves_has_no_degree_to_try() -> None:
    data = []
    for t in joint_data.made([joint_data.truth("arm_3_joint", "total", 1, 30.0, 1)]):
        q = t.q_motor.copy()
        q[:, ARM_3] = 0.3
        data.append(replace(t, q_motor=q))
    samples = [samples_of(joint_data.inputs(), t, ZERO)[ARM_3] for t in data]
    assert worthwhile(candidates(samples, "total")) == ()  # type: ignore[arg-type]


def test_joints_that_never_move_are_reported_and_not_corrected() -> None:
    data = []
    for t in joint_data.made([joint_data.truth("arm_3_joint", "total", 1, 30.0, 1)]):
        q, still = t.q_motor.copy(), t.q_link.copy()
        q[:, ARM_3] = 0.3
        still[:, ARM_3] = 0.3 - ZERO[ARM_3] - 1e-3 * np.sin(t.t_robot)
        data.append(replace(t, q_motor=q, q_link=still))
    models, verdicts = fitted(data)
    assert models.model("arm_3_joint").degree is None
    said = [v for v in verdicts if "no two trials excite" in v.message]
    assert [v.verdict for v in said] == ["missing"] and said[0].message.split(":")[0].endswith("excite arm_3_joint")


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        (lambda q, other: -q, "has its sign turned"),
        (lambda q, other: np.degrees(q), "is in degrees"),
        (lambda q, other: 1.05 * q, "has 1.05 of its motor's scale"),
        (lambda q, other: 0.0 * q + 0.3, "does not move"),
        (lambda q, other: np.minimum(q, np.quantile(q, 0.7)), "does not exceed"),
        (lambda q, other: other, "follows the motor of arm_3_joint"),
        (lambda q, other: q + 2.0 * np.pi * (q > np.median(q)), "wraps by"),
    ],
    ids=["sign", "degrees", "scale", "stuck", "saturated", "swapped", "wrapped"],
)
def test_link_readings_that_are_not_the_joint_s_are_refused_by_name(trials: list[Trial], wrong, why: str) -> None:
    """A polynomial of the angle would explain them all the same."""
    data = []
    for t in trials[:-1]:
        link = t.q_link.copy()
        link[:, ARM_6] = wrong(t.q_link[:, ARM_6], t.q_link[:, ARM_3])
        data.append(replace(t, q_link=link))
    data.append(trials[-1])
    models, verdicts = fitted(data)
    assert models.models == ()
    assert [v.verdict for v in verdicts] == ["refused"]
    message = verdicts[0].message
    assert "arm_6_joint" in message and why in message
    assert trials[0].id in message and trials[-1].id not in message


def test_joints_without_a_link_encoder_are_reported(trials: list[Trial]) -> None:
    without = []
    for trial in trials:
        link = trial.q_link.copy()
        link[:, ARM_3] = np.nan
        without.append(replace(trial, q_link=link))
    models, verdicts = fitted(without)
    assert "arm_3_joint" not in [m.joint for m in models.models]
    assert verdicts[0].verdict == "missing"
    assert "torso_lift_joint, arm_3_joint" in verdicts[0].message
    trial = without[0]
    assert (correct(models, trial.t_robot, trial.q_motor).q[:, ARM_3] == trial.q_motor[:, ARM_3]).all()
    np.testing.assert_array_equal(aligned_link_readings(trial, models.zero)[:, ARM_3], trial.q_motor[:, ARM_3])


def test_without_a_static_posture_there_is_no_zero_and_no_model(trials: list[Trial]) -> None:
    models, verdicts = fitted(trials[:-1])
    assert models.models == ()
    assert [v.verdict for v in verdicts] == ["missing"]
    assert "static" in verdicts[0].message


def test_zero_is_the_mean_over_the_dwells_and_aligned_readings_have_none() -> None:
    q = np.repeat(rigid_robot.CENTRE[None], 600, axis=0)
    y = np.zeros_like(q)
    y[:300, ARM_6], y[300:, ARM_6] = 6e-3, -2e-3
    trial = joint_data.recorded("rest", q, y, np.array([[0.1, 2.9], [3.1, 5.9]]))
    zero = link_zeros([trial], ROBOT)
    assert zero[ARM_6] == pytest.approx(ZERO[ARM_6] + 2e-3, abs=1e-12)
    assert np.isnan(zero[0])
    aligned = aligned_link_readings(trial, zero)
    assert (trial.q_motor - aligned)[:, ARM_6].mean() == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_array_equal(aligned[:, 0], trial.q_motor[:, 0])


def test_a_trial_carries_its_own_payload() -> None:
    light = joint_data.inputs()
    data = rigid_robot.description([], payload={
        "link": "gripper_grasping_frame", "mass": 2.0, "com": [0.0, 0.0, 0.0], "tolerance": 0.1,
    })  # fmt: skip
    heavy = input_model(Laboratory(mjcf.urdf(), Description.model_validate(data)), joint_data.hand())
    q, still = rigid_robot.CENTRE[None] + OFFSET, np.zeros((1, 8))
    more = heavy.inputs(np.zeros(1), q, still).tau - light.inputs(np.zeros(1), q, still).tau
    chain = joint_data.hand().chain
    J = chain.joint_jacobians(rigid_robot.CENTRE[None])[0]
    R = chain.poses(rigid_robot.CENTRE[None])[0, :3, :3]
    np.testing.assert_allclose(more[0], 2.0 * 9.81 * (R @ J[:3])[2], atol=1e-9)
