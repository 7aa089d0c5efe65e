"""Arm base and tool on SE(3)."""

from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration.errors import NotEnoughData
from calibration.estimate.estimate import Estimate, RobotNames
from calibration.mocap.postures import Postures
from calibration.numerics.alignment import start
from calibration.numerics.lie import exp6, from_vector, inverse, log6, to_vector
from calibration.prediction.compensator import Compensator
from calibration.robot.chain import chain_of
from calibration.robot.laboratory import Laboratory
from calibration.robot.nominal_frames import arm_poses, as_placements, first_joint, nominal_arm, placement_derivative
from calibration.stages.frames.arm_tool_fit import fit_arm_tool, residuals
from calibration.stages.frames.arm_tool_stage import locate_arm
from calibration.stages.frames.base_stage import locate_base
from tests.doubles import rigid_robot, spinning_base

N = 20
X = exp6(np.array([0.3, -2.0, 0.1, 0.4, 2.5, 0.3]))
Y = exp6(np.array([0.03, -0.2, 0.1, 0.4, -2.5, 0.3]))
DESCRIBED = rigid_robot.described()
LAB = Laboratory(mjcf.urdf(), DESCRIBED)
BASE = spinning_base.TRUE
DELTA = exp6(np.array([6e-3, -4e-3, 5e-3, 8e-3, -12e-3, 10e-3]))
HAND = np.array([3e-3, 2e-3, -4e-3, 20e-3, -10e-3, 15e-3])


@pytest.fixture(scope="module")
def chain():
    return chain_of(mjcf.urdf(), DESCRIBED)


@pytest.fixture(scope="module")
def q():
    return rigid_robot.near_postures(np.random.default_rng(0), N, torso=False)


@pytest.fixture(scope="module")
def A(chain, q):
    return inverse(arm_poses(chain, q)) @ chain.poses(q)


@pytest.fixture(scope="module")
def covariance():
    """Of each posture its own, full."""
    rng = np.random.default_rng(1)
    L = np.eye(6) + 0.4 * np.tril(rng.normal(size=(N, 6, 6)))
    scale = np.array([1e-5] * 3 + [4e-5] * 3) * rng.uniform(0.5, 3.0, size=(N, 1))
    L = scale[..., None] * L
    return L @ np.swapaxes(L, 1, 2)


def noisy(M, covariance, rng):
    return M @ exp6(np.einsum("nij,nj->ni", np.linalg.cholesky(covariance), rng.normal(size=(N, 6))))


def errors(found):
    return np.concatenate([log6(inverse(X) @ found.X), log6(inverse(Y) @ found.Y)])


def test_without_noise_the_truth_is_found_from_no_guess_at_all(A, covariance):
    found = fit_arm_tool(X @ A @ Y, A, covariance)
    assert found.converged
    np.testing.assert_allclose(found.X, X, atol=1e-10)
    np.testing.assert_allclose(found.Y, Y, atol=1e-10)


def test_the_closed_form_start_is_exact_without_noise(A):
    for found, true in zip(start(X @ A @ Y, A), (X, Y), strict=True):
        np.testing.assert_allclose(found, true, atol=1e-10)


def test_derivatives_are_those_of_the_residuals(A):
    M = X @ A @ Y @ exp6(np.random.default_rng(2).normal(size=(N, 6)) * 0.2)
    _, J = residuals(X, Y, M, A)
    for k in range(12):
        h = 1e-6 * np.eye(12)[k]
        ends = [residuals(X @ exp6(s * h[:6]), Y @ exp6(s * h[6:]), M, A)[0] for s in (1, -1)]
        np.testing.assert_allclose((ends[0] - ends[1]) / 2e-6, J[:, :, k], atol=2e-8)


def test_equation_6_is_evaluated_as_it_is_written(A):
    """log(T1^-1 T2) of one posture, by the definition of the matrix logarithm."""
    from scipy.linalg import logm

    M = (X @ A @ Y)[:1] @ exp6(np.array([[0.1, -0.2, 0.3, 0.2, -0.1, 0.4]]))
    S = np.real(logm(np.linalg.solve(M[0], X @ A[0] @ Y)))
    literal = np.array([*S[:3, 3], S[2, 1], S[0, 2], S[1, 0]])
    np.testing.assert_allclose(residuals(X, Y, M, A[:1])[0][0], literal, atol=1e-12)


def test_errors_are_at_the_cramer_rao_bound_and_covered(A, covariance):
    found = [fit_arm_tool(noisy(X @ A @ Y, covariance, np.random.default_rng(s)), A, covariance) for s in range(300)]
    e = np.array([errors(f) for f in found])
    bound = np.sqrt(np.diag(fit_arm_tool(X @ A @ Y, A, covariance).covariance))
    assert (np.sqrt((e**2).mean(axis=0)) <= 1.1 * bound).all()
    sigma = np.array([np.sqrt(np.diag(f.covariance)) for f in found])
    assert 0.93 <= (np.abs(e) < 1.96 * sigma).mean() <= 0.97
    nees = [x @ np.linalg.solve(f.covariance, x) for x, f in zip(e, found, strict=True)]
    assert abs(np.mean(nees) - 12.0) < 3.0 * np.sqrt(24.0 / 300)


def test_weights_matter(A, covariance):
    even = np.broadcast_to(np.diag([1e-10] * 3 + [1.6e-9] * 3), covariance.shape)
    ours, theirs = [], []
    for s in range(60):
        M = noisy(X @ A @ Y, covariance, np.random.default_rng(s))
        ours.append(errors(fit_arm_tool(M, A, covariance)))
        theirs.append(errors(fit_arm_tool(M, A, even)))
    assert np.linalg.norm(ours) < 0.8 * np.linalg.norm(theirs)


def test_a_robust_fit_survives_a_posture_that_does_not_belong(A, covariance):
    M = noisy(X @ A @ Y, covariance, np.random.default_rng(5))
    M[3] = M[3] @ exp6(np.array([0.02, 0.0, 0.0, 0.0, 0.05, 0.0]))
    plain, robust = (fit_arm_tool(M, A, covariance, robust) for robust in (False, True))
    sigma = np.sqrt(np.diag(plain.covariance))
    assert np.abs(errors(plain) / sigma).max() > 30.0
    assert np.abs(errors(robust) / sigma).max() < 4.0
    assert robust.converged and robust.weight[3] < 1e-3


def test_an_arm_that_turns_about_one_axis_is_refused(chain):
    q = np.tile(rigid_robot.CENTRE, (8, 1))
    q[:, 3] += np.linspace(0.0, 1.0, 8)
    A = inverse(arm_poses(chain, q)) @ chain.poses(q)
    with pytest.raises(NotEnoughData, match="one axis only"):
        fit_arm_tool(X @ A @ Y, A, np.broadcast_to(np.eye(6), (8, 6, 6)))


def test_the_arm_begins_after_the_lift(chain):
    assert first_joint(chain) == "arm_1_joint"
    T = nominal_arm(chain) @ DELTA
    q = rigid_robot.near_postures(np.random.default_rng(3), 5)
    moved = chain.with_placements(as_placements(chain, T))
    np.testing.assert_allclose(nominal_arm(moved), T, atol=1e-12)
    np.testing.assert_allclose(
        moved.poses(q), arm_poses(chain, q) @ DELTA @ inverse(arm_poses(chain, q)) @ chain.poses(q), atol=1e-12
    )


def test_the_derivative_of_the_arms_placement(chain):
    vector, row = to_vector(nominal_arm(chain) @ DELTA), chain.joints.index("arm_1_joint")
    for k in range(6):
        h = 1e-6 * np.eye(6)[k]
        ends = [as_placements(chain, from_vector(vector + s * h))[row] for s in (1, -1)]
        np.testing.assert_allclose((ends[0] - ends[1]) / 2e-6, placement_derivative(chain, vector)[:, k], atol=1e-8)


def postures(chain, q, rng=None, size=1e-6):
    """Hand poses in the base body of a robot whose arm stands at DELTA and whose tool is at HAND."""
    T = inverse(from_vector(BASE)) @ arm_poses(chain, q) @ DELTA @ inverse(arm_poses(chain, q)) @ chain.poses(q)
    T = T @ from_vector(HAND)
    S = np.broadcast_to(size**2 * np.diag([1.0] * 3 + [9.0] * 3), (len(q), 6, 6))
    if rng is not None:
        T = T @ exp6(np.einsum("nij,nj->ni", np.linalg.cholesky(S), rng.normal(size=(len(q), 6))))
    return Postures(q, T, S, np.zeros(len(q)))


@pytest.fixture(scope="module")
def base_frame(chain):
    return locate_base(LAB, spinning_base.stations(*spinning_base.path()))[0]


def test_spins_split_what_a_standing_base_cannot(chain, q, base_frame):
    model, said = locate_arm(LAB, postures(chain, q), base_frame)
    values = np.array([p.value for p in model.parameters])
    np.testing.assert_allclose(values[:6], BASE, atol=1e-10)
    np.testing.assert_allclose(from_vector(values[6:12]), nominal_arm(chain) @ DELTA, atol=1e-10)
    np.testing.assert_allclose(values[12:], HAND, atol=1e-10)
    assert {p.status for p in model.parameters} == {"estimated"}
    assert [v.verdict for v in said] == ["ok"]


def test_the_gauge_is_reported_where_the_base_only_stood(chain, q):
    model, said = locate_arm(LAB, postures(chain, q), None)
    assert model.rank == 12
    status = {p.name: p.status for p in model.parameters}
    assert all(status[f"frame.tool.hand.{a}"] == "estimated" for a in ("x", "y", "z", "rx", "ry", "rz"))
    assert all(status[f"frame.base.{f}.{a}"] == "combined" for f in ("base", "arm") for a in ("x", "y", "rx", "rz"))
    assert any(v.verdict == "warning" and "6 of 18 directions" in v.message for v in said)
    tolerance = DESCRIBED.tolerances.body_translation
    assert all(p.sigma >= 0.99 * tolerance for p in model.parameters[:3])


def test_the_models_covariance_is_that_of_its_errors(chain, q, base_frame):
    """Over spins and postures of new noise: errors of all 18 against the model's own covariance, drawing of B apart."""
    true = np.concatenate([BASE, to_vector(nominal_arm(chain) @ DELTA), HAND])
    z = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        spun = locate_base(LAB, spinning_base.stations(*spinning_base.path(3e-4, rng=rng), spinning_base.SIGMA, rng))[0]
        model, _ = locate_arm(LAB, postures(chain, q, rng, 3e-5), spun)
        e = np.array([p.value for p in model.parameters]) - true
        z.append(e / np.array([p.sigma for p in model.parameters]))
    freely = [0, 1, 5, 6, 7, 11, *range(12, 18)]  # height and tilt carry the standing base's tolerance, not drawn here
    covered = (np.abs(np.array(z)[:, freely]) < 1.96).mean()
    assert 0.90 < covered < 0.98


@pytest.mark.parametrize("followed", [False, True])
def test_an_arm_that_is_not_the_factorys_is_reported_and_no_warning_where_it_is_calibrated(
    chain, q, base_frame, followed
):
    data = postures(chain, q)
    bent = postures(chain, q + 2e-3 * np.random.default_rng(0).normal(size=q.shape))
    model, said = locate_arm(LAB, replace(bent, q=data.q), base_frame, followed)
    (found,) = (v for v in said if "not as the factory drew it" in v.message)
    assert found.verdict == ("ok" if followed else "warning")
    assert min(p.sigma for p in model.parameters[12:]) > 1e-4


def test_the_hand_is_predicted_by_the_same_numbers(chain, q, base_frame):
    """Model, URDF and `Compensator` speak of one robot, and its uncertainty does not hang on the base's gauge."""
    model, _ = locate_arm(LAB, postures(chain, q), base_frame)
    names = RobotNames(chain.measured, chain.base_frame, chain.tool_frame)
    robot = Compensator.of(Estimate("calibrated", (), (), (model,), "arm_tool", mjcf.urdf(), names))
    np.testing.assert_allclose(robot.hand.poses(q), postures(chain, q).T_base_hand, atol=1e-10)
    found = robot.predict(np.zeros(N), q)
    S = robot.covariance
    J = robot.hand.poses_and_derivatives(q, names=robot.names).J
    in_base_body = np.sqrt(np.diagonal(J @ S @ np.swapaxes(J, 1, 2), axis1=1, axis2=2))
    assert in_base_body.max() < 1e-5  # of T_base_B, 2 mm and 2 mrad, nothing is left
    assert np.isfinite(found.covariance).all()
