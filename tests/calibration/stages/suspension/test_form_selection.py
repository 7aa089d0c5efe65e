import numpy as np
import pytest

from calibration.numerics.signals import RATE
from calibration.recording.schema import Sigmas
from calibration.stages.suspension.compliance_fit import fit_compliance
from calibration.stages.suspension.cross_validation import HeldOut, held_out
from calibration.stages.suspension.form_selection import Springs, not_positive, printed_springs, refusal
from calibration.stages.suspension.modal_response import modes_of, predicted
from calibration.stages.suspension.wheels import (
    element_parameters,
    frame_sigma,
    matrices,
    normal_of,
    solve,
    wheel_model,
    wheel_parameters,
)
from tests.doubles import rigid_robot
from tests.doubles.moving_base import WHEELS, response, smooth, values

SIGMAS = Sigmas(marker=1e-4, encoder=1e-5, plate_force=1.2, plate_moment=0.35)
DESCRIPTION = rigid_robot.described(wheels=[w.model_dump() for w in WHEELS])
NONE = np.zeros((6, 6))
LOADS = np.array([5.0, 5.0, 20.0, 15.0, 15.0, 4.0])


def matrix_error(found, true):
    q = np.sqrt(np.diag(true))
    return np.abs((found - true) / np.outer(q, q)).max()


@pytest.mark.parametrize("point", ["centre", "contact"])
def test_printed_combinations_come_back_exactly(point):
    rng = np.random.default_rng(0)
    wheels, p = wheel_model(WHEELS, point), values(rng)
    K, C = matrices(wheels, p)
    G = np.zeros((6, 6))
    G[0, 4], G[1, 3] = -730.0, 730.0
    responses = []
    for k in range(3):
        x = smooth(rng, 30.0, np.full(6, 1e-3), fastest=1.0)
        w = x @ (K + G).T + np.gradient(x, 1.0 / RATE, axis=0) @ C.T
        responses.append(response(str(k), w, x, G=G))
    normals = [normal_of(wheels, s, SIGMAS) for s in responses]
    found = solve(wheels, normals)
    assert (found >= 0.0).all()
    np.testing.assert_allclose(wheels.matrix(found[:36]), K, rtol=1e-6, atol=1e-6 * np.sqrt(K.max()))
    parameters, combinations = wheel_parameters(wheels, found, np.tile(found, (3, 1)), 5)
    assert len(parameters) == 72 and len(combinations) > 10
    for c in combinations:
        assert c.value == pytest.approx(c.coefficients[5:] @ p, rel=1e-6)


def test_the_compliance_comes_back_and_gravity_is_distinguished():
    rng = np.random.default_rng(1)
    wheels = wheel_model(WHEELS, "contact")
    K, C = matrices(wheels, values(rng))
    W, h = 730.0, 0.37
    M = np.diag([74.0, 74.0, 74.0, 20.0, 21.0, 4.0])
    M[0, 4] = M[4, 0] = 27.0
    M[1, 3] = M[3, 1] = -27.0
    gravity = np.zeros((6, 6))
    gravity[3, 3] = gravity[4, 4] = -W * h
    for inertia, G in ((NONE, NONE), (M, gravity)):
        w = [smooth(rng, 18.0, LOADS, fastest=6.0) for _ in range(2)]
        responses = [
            response(str(k), w_k, modes_of(K + G, C, inertia).respond(w_k, 1.0 / RATE), inertia, G)
            for k, w_k in enumerate(w)
        ]
        found = fit_compliance(responses, wheels.couples)
        assert matrix_error(found.K, K) < 1e-3
        assert matrix_error(found.C, C) < 2e-2
    assert W * h / K[3, 3] > 5e-3  # what forgetting gravity would cost


def test_the_uncertainty_of_the_compliance_covers_the_truth():
    rng = np.random.default_rng(2)
    wheels = wheel_model(WHEELS, "contact")
    K, C = matrices(wheels, values(rng))
    noise = np.array([2e-5, 2e-5, 2e-5, 1e-4, 1e-4, 5e-5])
    responses = []
    for k in range(4):
        w = smooth(rng, 18.0, LOADS, fastest=6.0)
        x = modes_of(K, C, NONE).respond(w, 1.0 / RATE) + noise * rng.normal(size=w.shape)
        responses.append(response(str(k), w, x))
    found = fit_compliance(responses, wheels.couples)
    sigma, _ = found.sigmas()
    z = ((found.K - K) / np.where(wheels.couples, sigma, np.inf))[wheels.couples]
    assert np.abs(z).max() < 4.5 and np.sqrt((z**2).mean()) < 2.0
    assert (np.diag(sigma)[[3, 4]] < 0.01 * np.diag(K)[[3, 4]]).all()


def test_a_fold_is_the_fit_without_that_trial():
    rng = np.random.default_rng(3)
    wheels = wheel_model(WHEELS, "contact")
    K, C = matrices(wheels, values(rng))
    responses = []
    for k in range(3):
        w = smooth(rng, 20.0, LOADS, fastest=6.0)
        x = modes_of((1.0 + 0.1 * k) * K, C, NONE).respond(w, 1.0 / RATE)
        responses.append(response(str(k), w, x))
    whole, alone = fit_compliance(responses, wheels.couples), fit_compliance(responses[:2], wheels.couples)
    fold = whole.without(2)[0]
    q = np.sqrt(np.diag(alone.K))
    assert np.abs((fold - alone.K) / np.outer(q, q)).max() < 0.02


def springs(K, C):
    return Springs(K, C, (), (NONE, NONE), np.ones((6, 6), dtype=bool))


def judged(r2):
    motion = np.ones((2, 6))
    return HeldOut(motion * (1.0 - np.array(r2)), motion, 1e-6 * motion, np.full(len(motion), 500.0))


def test_a_printed_fit_that_cannot_be_used_is_refused():
    good = judged([0.9] * 6)
    K, C = np.diag([8e4, 9e4, 9e5, 2e4, 2e4, 4e3]), np.diag([500.0, 500.0, 1e4, 300.0, 300.0, 20.0])
    assert refusal(springs(K, C), good, good) == ""
    soft = K.copy()
    soft[5, 5] = 10.0
    assert "drifts" in refusal(springs(soft, C), good, good)
    soft[5, 5] = 0.0
    assert "positive definite" in not_positive(springs(soft, C))
    wrong = C.copy()
    wrong[3, 3] = -50.0
    assert "damping" in not_positive(springs(K, wrong))
    slips, poor = judged([0.9] * 5 + [-20.0]), judged([0.9, 0.5] + [0.9] * 4)
    assert "worse than a base at rest along rz" in refusal(springs(K, C), slips, good)
    assert "worse than the compliance along y" in refusal(springs(K, C), poor, good)


@pytest.mark.parametrize(("turning", "held"), [(1.0, ""), (0.5, "suspension.")], ids=["inside", "outside"])
def test_a_printed_fit_at_its_bound_is_refused_by_name(turning, held):
    """A yaw stiffness softer than wheels that are no softer along x and y can have: some spring would be negative."""
    rng = np.random.default_rng(0)
    wheels = wheel_model(WHEELS, "centre")
    K, C = matrices(wheels, values(rng))
    K[5, 5] *= turning
    K[0, 0] *= 1.0 if turning == 1.0 else 0.6
    assert np.linalg.eigvalsh(K)[0] > 0.0
    noise = np.array([2e-6, 2e-6, 2e-6, 1e-5, 1e-5, 5e-6])
    responses = []
    for k in range(3):
        w = smooth(rng, 18.0, LOADS, fastest=6.0)
        responses.append(
            response(str(k), w, modes_of(K, C, NONE).respond(w, 1.0 / RATE) + noise * rng.normal(size=w.shape))
        )
    found = printed_springs(DESCRIPTION, wheels, responses)
    assert (found.wheels[1] == 0.0).sum() > 20  # zeros alone are no bound
    assert found.bound.startswith(held) and bool(found.bound) == bool(held)
    assert not_positive(found) == (f"at its bound, {found.bound} would be negative" if held else "")


@pytest.mark.parametrize("axis", [2, 4, 5])
def test_an_axis_that_follows_its_load_the_wrong_way_round_is_no_spring_s(axis):
    rng = np.random.default_rng(5)
    wheels = wheel_model(WHEELS, "contact")
    K, C = matrices(wheels, values(rng))
    turned = np.where(np.arange(6) == axis, -1.0, 1.0)
    responses = []
    for k in range(2):
        w = smooth(rng, 18.0, LOADS, fastest=6.0)
        responses.append(response(str(k), w, turned * modes_of(K, C, NONE).respond(w, 1.0 / RATE)))
    found = fit_compliance(responses, wheels.couples)
    tried = held_out(responses, found.without)
    assert tried.moves.tolist() == [k != axis for k in range(6)]
    known = element_parameters("K", found.K, found.sigmas()[0], wheels.couples, tried.slips)
    status = {p.name[-2:]: p.status for p in known}
    assert {k for k, s in status.items() if s == "not_identifiable"} >= {k for k in status if str(axis + 1) in k}
    assert status["11"] == status["22"] == "estimated"


def test_r2_compares_with_a_base_that_stays():
    rng = np.random.default_rng(4)
    K, C = np.diag([8e4, 9e4, 9e5, 2e4, 2e4, 4e3]), np.diag([500.0, 500.0, 1e4, 300.0, 300.0, 20.0])
    responses = []
    for k in range(3):
        w = smooth(rng, 20.0, LOADS)
        x = modes_of(K, C, NONE).respond(w, 1.0 / RATE)
        x[:, 5] = np.cumsum(rng.normal(size=len(x))) * 1e-4  # slips where no spring would put it
        responses.append(response(str(k), w, x))
    tried = held_out(responses, lambda k: (K, C))
    np.testing.assert_allclose(tried.r2[:5], 1.0)
    literal = 1.0 - sum(((s.x - predicted(K, C, s.forcing)) ** 2).sum(axis=0) for s in responses) / sum(
        (s.x**2).sum(axis=0) for s in responses
    )
    np.testing.assert_allclose(tried.r2, literal)
    assert tried.moves[:5].all() and not tried.moves[5]
    assert tried.explained[5] < 0.1
    assert tried.slips.tolist() == [False] * 5 + [True]


def test_one_trial_alone_does_not_move_an_axis():
    motion = np.ones((5, 6))
    error = motion.copy()
    error[0] = 0.0
    assert HeldOut(error, motion, 0.0 * motion, np.ones(len(motion))).r2[0] == pytest.approx(0.2)
    assert not HeldOut(error, motion, 0.0 * motion, np.ones(len(motion))).moves.any()
    error[1] = 0.5
    assert HeldOut(error, motion, 0.0 * motion, np.ones(len(motion))).moves.all()


def test_what_slips_is_no_spring_and_is_not_reported_as_one():
    K = np.diag([8e4, 9e4, 9e5, 2e4, 2e4, 4e3])
    sigma, couples = 0.01 * K, np.eye(6, dtype=bool)
    sigma[2, 2] = 0.5 * K[2, 2]
    found = element_parameters("K", K, sigma, couples, np.array([True, False, False, False, False, True]))
    assert [p.name[-2:] for p in found] == ["11", "22", "33", "44", "55", "66"]
    assert [p.status == "estimated" for p in found] == [False, True, False, True, True, False]
    assert [p.unit for p in found][2:4] == ["N/m", "N.m/rad"]


def test_a_frame_that_is_off_counts_in_the_uncertainty():
    K = np.diag([8e4, 9e4, 9e5, 2e4, 2e4, 4e3])
    tolerances = rigid_robot.described().tolerances
    d = tolerances.body_translation
    A = np.eye(6)
    A[2, 4] = -d  # the point that was taken for the origin is d ahead of it
    A[1, 5] = d
    shifted = A.T @ K @ A
    sigma = frame_sigma(K, tolerances)
    assert sigma[2, 4] == pytest.approx(abs(shifted[2, 4]), rel=1e-9)
    assert sigma[1, 5] == pytest.approx(abs(shifted[1, 5]), rel=1e-9)
    assert sigma[2, 2] == 0.0


def test_a_fit_that_is_singular_without_one_trial_is_reported():
    good, singular = np.eye(6), np.diag([0.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    sigmas = (np.zeros((6, 6)), np.zeros((6, 6)))
    whole = Springs(good, good, ((good, good), (good, good)), sigmas, np.ones((6, 6), dtype=bool))
    assert not_positive(whole) == ""
    left_out = Springs(good, good, ((good, good), (singular, good)), sigmas, np.ones((6, 6), dtype=bool))
    assert not_positive(left_out) == "its stiffness is not positive definite without one of the trials"
