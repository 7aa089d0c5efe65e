from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration.inference.identifiability import identifiability
from calibration.mocap.postures import Postures
from calibration.numerics.lie import exp6
from calibration.robot.chain import chain_of
from calibration.robot.hand import nominal_hand
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.geometry.guards import distinct
from calibration.stages.geometry.hand_residual import NoiseModel, fit, linearised
from calibration.stages.geometry.parameters import (
    geometry_parameters,
    reading_floor,
    reading_names,
    reading_sigma,
    registration_parameters,
)
from calibration.stages.geometry.registration import register
from calibration.stages.geometry.stage import calibrate_geometry, fit_robustly
from tests.doubles import rigid_robot

TINY = np.full(8, 1e-12)
GAPS = np.array([0.0, 1.0, 1.0, 1.5, 1.5, 3.0, 12.0, 10.0]) * 1e-3


GEOMETRIC = geometry_parameters(chain_of(mjcf.urdf(), rigid_robot.described()), rigid_robot.described()).names


def fitted(chain, postures, description=None, **start):
    description = description or rigid_robot.described()
    parameters = geometry_parameters(chain, description)
    hand = nominal_hand(chain, nominal_frames(chain, description))
    play, floor = start.get("reading", TINY), start.get("floor", TINY)
    return hand, parameters, fit(hand, parameters, postures, play, floor)


def with_play(truth, q, seed=0):
    """Postures whose joints each stand somewhere within their gap."""
    moved = q + np.random.default_rng(seed).uniform(-1.0, 1.0, size=q.shape) * GAPS
    found = rigid_robot.postures(truth, moved, 2e-5, seed)
    return replace(found, q=q + truth.offset)


def selected(postures, rows):
    return Postures(postures.q[rows], postures.T_base_hand[rows], postures.covariance[rows], postures.misfit[rows])


def test_static_postures_count_beside_more_samples_of_motions(chain):
    description, rng = rigid_robot.described(), np.random.default_rng(4)
    found = rigid_robot.postures(rigid_robot.defects(1), rigid_robot.random_angles(rng, 40), 2e-5, 4)
    moving = np.arange(40) >= 12
    postures = replace(found, misfit=np.where(moving, 0.0, 2.6e-4), motion=np.where(moving, 0, -1))
    hand, parameters = (
        nominal_hand(chain, nominal_frames(chain, description)),
        geometry_parameters(chain, description),
    )
    kept = fit_robustly(hand, parameters, postures, NoiseModel(TINY, TINY, np.zeros(0), True)).kept
    assert kept.sum() >= 38 and kept[~moving].all()


@pytest.mark.parametrize("torso, rank", [(True, 36), (False, 34)])
def test_without_noise_the_hand_is_predicted_to_1e_8_everywhere(chain, torso, rank):
    truth = rigid_robot.defects(1)
    q = rigid_robot.random_angles(np.random.default_rng(1), 30, torso)
    hand, parameters, found = fitted(chain, rigid_robot.postures(truth, q))
    known = identifiability(found.J_white, parameters)
    assert found.converged
    assert (known.rank, known.clear) == (rank, True)
    new = rigid_robot.random_angles(np.random.default_rng(2), 200, torso)
    predicted = hand.with_theta(found.theta, GEOMETRIC).poses(new + truth.offset)
    np.testing.assert_allclose(predicted, rigid_robot.hand_in_base(truth, new), atol=1e-8)


def test_without_noise_identifiable_combinations_are_recovered_to_1e_8(chain):
    # Small defects: a combination is linear in the parameters, what it leaves out is of second order.
    truth = rigid_robot.defects(3, scale=1e-3)
    q = rigid_robot.random_angles(np.random.default_rng(1), 40)
    _, parameters, found = fitted(chain, rigid_robot.postures(truth, q))
    known = identifiability(found.J_white, parameters)
    theta = np.concatenate([truth.base, truth.hand, truth.xi.ravel(), truth.offset])
    np.testing.assert_allclose(known.coefficients @ found.theta, known.coefficients @ theta, atol=1e-8)
    assert np.abs(found.theta - theta).max() > 1e-6  # alone they are not identifiable


def test_derivatives_of_the_residual_match_finite_differences(chain):
    truth = rigid_robot.defects(4)
    postures = rigid_robot.postures(rigid_robot.defects(5), rigid_robot.random_angles(np.random.default_rng(1), 4))
    hand = nominal_hand(chain, np.zeros(12))
    theta = np.concatenate([truth.base, truth.hand, truth.xi.ravel(), truth.offset])
    at, step = linearised(hand, theta, postures, GEOMETRIC), 1e-6
    for column in range(len(theta)):
        d = step * np.eye(len(theta))[column]
        numeric = (
            linearised(hand, theta + d, postures, GEOMETRIC).r - linearised(hand, theta - d, postures, GEOMETRIC).r
        )
        np.testing.assert_allclose(at.J[:, :, column], numeric / (2.0 * step), atol=1e-8)


def test_rank_base_parameters_and_values_do_not_depend_on_the_order_of_the_postures(chain):
    truth = rigid_robot.defects(1)
    postures = rigid_robot.postures(truth, rigid_robot.random_angles(np.random.default_rng(1), 30), 1e-5)
    back = selected(postures, np.arange(30)[::-1])
    one, other = (fitted(chain, p) for p in (postures, back))
    a, b = (identifiability(f.J_white, parameters) for _, parameters, f in (one, other))
    assert a.base == b.base and a.status == b.status
    np.testing.assert_allclose(one[2].theta, other[2].theta, atol=1e-9)


def test_every_parameter_of_a_combination_is_said_to_be_combined(chain):
    postures = rigid_robot.postures(rigid_robot.Truth(), rigid_robot.random_angles(np.random.default_rng(1), 30))
    _, parameters, found = fitted(chain, postures)
    status = dict(zip(parameters.names, identifiability(found.J_white, parameters).status, strict=True))
    assert status["encoder.arm_3_joint.motor.offset"] == status["geometry.arm_3_joint.rz"] == "combined"
    assert status["geometry.arm_3_joint.rx"] == "estimated"


def test_random_reading_errors_are_estimated_joint_by_joint(chain):
    description, q = rigid_robot.described(), rigid_robot.near_postures(np.random.default_rng(1), 200)
    start = {"reading": reading_sigma(chain, description), "floor": reading_floor(chain, description)}
    _, _, found = fitted(chain, with_play(rigid_robot.defects(1), q), description, **start)
    assert found.converged
    np.testing.assert_allclose(found.noise_sigma(reading_names(chain))[1:], GAPS[1:] / np.sqrt(3.0), rtol=0.2)
    assert found.noise_sigma(reading_names(chain))[0] < 1e-4


def test_prior_widths_hardly_matter(chain):
    truth, description = rigid_robot.defects(1), rigid_robot.described()
    q = rigid_robot.near_postures(np.random.default_rng(1), 40)
    new = rigid_robot.near_postures(np.random.default_rng(2), 200)
    errors = []
    for factor in (1.0, 3.0, 1.0 / 3.0):
        wide = {k: factor * v for k, v in rigid_robot.description([])["tolerances"].items()}
        wide["joint_play"] = description.tolerances.joint_play
        start = {"reading": reading_sigma(chain, description), "floor": reading_floor(chain, description)}
        hand, _, found = fitted(chain, with_play(truth, q), rigid_robot.described(tolerances=wide), **start)
        T = hand.with_theta(found.theta, GEOMETRIC).poses(new + truth.offset)
        errors.append(np.sqrt(((T - rigid_robot.hand_in_base(truth, new))[:, :3, 3] ** 2).mean()))
    assert max(errors[1:]) <= 1.1 * errors[0]


def test_intervals_of_combinations_cover_the_truth(chain):
    description, z = rigid_robot.described(), []
    for seed in range(8):
        truth = rigid_robot.defects(seed)
        q = rigid_robot.near_postures(np.random.default_rng(100 + seed), 40)
        model, _ = calibrate_geometry(chain, description, with_play(truth, q, seed))
        theta = np.concatenate([truth.base, truth.hand, truth.xi.ravel(), truth.offset])
        z += [(c.value - c.coefficients @ theta) / c.sigma for c in model.combinations]
    covered = np.mean(np.abs(z) < 1.96)
    assert len(z) > 100
    assert 0.90 <= covered <= 0.99


def test_registration_alone_recovers_both_frames(chain):
    truth = replace(rigid_robot.defects(2), xi=np.zeros((8, 6)), offset=np.zeros(8))
    model, verdicts = register(
        chain,
        rigid_robot.described(),
        rigid_robot.postures(truth, rigid_robot.random_angles(np.random.default_rng(1), 12)),
    )
    assert [v.verdict for v in verdicts] == ["ok"]
    np.testing.assert_allclose([p.value for p in model.parameters], np.r_[truth.base, truth.hand], atol=1e-8)


def test_registration_does_not_take_samples_of_a_swing_for_independent(chain):
    """Two swings whose residuals keep 0.9 of themselves from sample to sample beside ten static postures."""
    truth, z = replace(rigid_robot.defects(2), xi=np.zeros((8, 6)), offset=np.zeros(8)), []
    t = np.arange(150) / 2.0
    centre, angles = rigid_robot.CENTRE, np.arange(8)
    swings = [centre + 0.5 * np.sin(t[:, None] * (0.3 + 0.07 * angles) + k + angles) for k in range(2)]
    q = np.concatenate([rigid_robot.near_postures(np.random.default_rng(1), 10), *swings])
    motion, size = np.repeat([-1, 0, 1], [10, 150, 150]), np.repeat([1e-3, 2e-3], 3)
    still = replace(rigid_robot.postures(truth, q), motion=motion)
    for seed in range(40):
        e = np.random.default_rng(seed).normal(size=(len(q), 6))
        for k in range(1, len(q)):
            if motion[k] >= 0 and motion[k] == motion[k - 1]:
                e[k] = 0.9 * e[k - 1] + np.sqrt(1.0 - 0.9**2) * e[k]
        model, _ = register(
            chain, rigid_robot.described(), replace(still, T_base_hand=still.T_base_hand @ exp6(e * size))
        )
        error = np.array([p.value for p in model.parameters]) - np.r_[truth.base, truth.hand]
        z.append(error / np.array([p.sigma for p in model.parameters]))
    assert 0.92 <= np.mean(np.abs(z) < 1.96) <= 0.98


def test_registration_says_what_one_turning_joint_cannot_tell(chain):
    q = np.tile(rigid_robot.CENTRE, (12, 1))
    q[:, 1] = np.linspace(0.2, 2.5, 12)
    _, verdicts = register(chain, rigid_robot.described(), rigid_robot.postures(rigid_robot.Truth(), q))
    assert verdicts[0].verdict == "warning" and "move another joint" in verdicts[0].message


def refusals(chain, postures, description=None):
    _, verdicts = calibrate_geometry(chain, description or rigid_robot.described(), postures)
    return " | ".join(v.message for v in verdicts if v.verdict == "refused")


def test_thirty_good_postures_are_not_refused(chain):
    postures = with_play(rigid_robot.defects(1), rigid_robot.near_postures(np.random.default_rng(1), 30))
    assert refusals(chain, postures) == ""


@pytest.mark.parametrize(("off", "kind", "words"), [(0.03, "ok", "other side of its"), (0.2, "warning", "contradict")])
def test_a_link_alone_on_the_other_side_of_its_gap_is_no_contradiction(chain, off, kind, words):
    truth = rigid_robot.defects(1)
    q = rigid_robot.random_angles(np.random.default_rng(0), 30)
    found = rigid_robot.postures(truth, q, 2e-5)
    read = q + truth.offset
    read[7, 6] += off
    verdicts = calibrate_geometry(chain, rigid_robot.described(), replace(found, q=read))[1]
    assert [v.verdict for v in verdicts if words in v.message] == [kind]


def test_beside_a_wrong_posture_the_other_side_of_a_gap_explains_none(chain):
    truth = rigid_robot.defects(1)
    q = rigid_robot.random_angles(np.random.default_rng(0), 30)
    found = rigid_robot.postures(truth, q, 2e-5)
    read, T = q + truth.offset, found.T_base_hand.copy()
    read[7, 6] += 0.03
    T[12, 0, 3] += 0.3
    verdicts = calibrate_geometry(chain, rigid_robot.described(), replace(found, q=read, T_base_hand=T))[1]
    (named,) = [v.message for v in verdicts if "left out" in v.message]
    assert "contradict" in named and named.endswith("7, 12")


def test_three_postures_are_refused(chain):
    postures = with_play(rigid_robot.defects(1), rigid_robot.near_postures(np.random.default_rng(1), 3))
    assert "3 distinct postures" in refusals(chain, postures)


def test_three_postures_twelve_times_are_refused(chain):
    q = np.repeat(rigid_robot.near_postures(np.random.default_rng(1), 3), 12, axis=0)
    q = q + 1e-4 * np.random.default_rng(2).normal(size=q.shape)
    said = refusals(chain, with_play(rigid_robot.defects(1), q))
    assert "3 distinct postures among 36" in said


def test_a_wrist_zero_of_forty_degrees_is_beyond_belief(chain):
    truth = replace(rigid_robot.defects(1), offset=np.array([0, 0, 0, 0, 0, 0, 0.7, 0]))
    postures = with_play(truth, rigid_robot.near_postures(np.random.default_rng(1), 30))
    assert "encoder.arm_6_joint.motor.offset" in refusals(chain, postures)


def test_a_joint_whose_readings_scatter_is_refused_by_name(chain):
    postures = with_play(rigid_robot.defects(1), rigid_robot.near_postures(np.random.default_rng(1), 30))
    q = postures.q.copy()
    q[:, 3] += 0.2 * np.random.default_rng(2).normal(size=30)
    assert "readings of arm_3_joint scatter by" in refusals(chain, replace(postures, q=q))


def test_joints_in_the_wrong_order_are_refused(chain):
    postures = with_play(rigid_robot.defects(1), rigid_robot.near_postures(np.random.default_rng(1), 16))
    swapped = replace(postures, q=postures.q[:, [0, 1, 3, 2, 4, 5, 6, 7]])
    assert refusals(chain, swapped) != ""


def test_the_fit_is_pure(chain):
    postures = with_play(rigid_robot.defects(1), rigid_robot.near_postures(np.random.default_rng(1), 20))
    before = [M.homogeneous.copy() for M in chain.model.jointPlacements]
    first, second = (calibrate_geometry(chain, rigid_robot.described(), postures)[0] for _ in range(2))
    assert first.parameters == second.parameters
    np.testing.assert_array_equal(first.covariance, second.covariance)
    np.testing.assert_array_equal(before, [M.homogeneous for M in chain.model.jointPlacements])


def test_postures_count_as_one_unless_a_joint_is_apart():
    q = np.array([[0.0, 0.0], [0.04, 0.0], [0.0, 0.2], [0.0, 0.21]])
    assert distinct(q, np.array([0.05, 0.05])) == 2


def test_registration_has_no_prior_and_geometry_has_the_datasheet_s(chain):
    description = rigid_robot.described()
    assert np.isinf(registration_parameters(chain, description).tolerance).all()
    parameters = geometry_parameters(chain, description)
    tolerance = dict(zip(parameters.names, parameters.tolerance, strict=True))
    assert tolerance["geometry.arm_1_joint.x"] == description.tolerances.joint_translation
    assert tolerance["encoder.torso_lift_joint.motor.offset"] == 0.1 * description.tolerances.encoder_offset
    assert len(parameters) == 68


@pytest.mark.parametrize("scale, size", [(0.1, 0.05), (1.0, 0.3)])
def test_wrong_postures_do_not_spoil_the_registration_and_are_named(chain, scale, size):
    truth, rng = rigid_robot.defects(3, scale), np.random.default_rng(3)
    good = rigid_robot.postures(truth, rigid_robot.near_postures(rng, 40), 1e-4)
    rows, T = np.sort(rng.choice(40, 6, replace=False)), good.T_base_hand.copy()
    T[rows, :3, 3] += size * np.array([1.0, 0.0, 0.0])  # all the same way: the worst for a mean
    rest = np.setdiff1d(np.arange(40), rows)
    clean, said = register(chain, rigid_robot.described(), good)
    assert [v.verdict for v in said] == ["ok"]
    wrong, said = register(chain, rigid_robot.described(), replace(good, T_base_hand=T))
    without, _ = register(chain, rigid_robot.described(), good.rows(rest))
    values = [np.array([p.value for p in model.parameters]) for model in (wrong, without, clean)]
    np.testing.assert_array_equal(values[0], values[1])
    assert said[-1].verdict == "warning" and said[-1].message.endswith(", ".join(map(str, rows)))
    assert np.abs(values[2] - values[1]).max() > 1e-6
