"""Dynamics of a random arm with branches, sliding and turning joints, against Pinocchio's."""

import numpy as np
import pinocchio as pin
import pytest

from calibration.robot.rigid_tree import last_wrench, tree_of
from calibration.robot.tree_dynamics import dynamics_along

KINDS = (pin.JointModelRX, pin.JointModelRevoluteUnaligned, pin.JointModelPrismaticUnaligned, pin.JointModelRUBZ)
N, K = 6, 9


@pytest.fixture(scope="module")
def arm() -> pin.Model:
    rng, model = np.random.default_rng(0), pin.Model()
    pin.seed(0)
    model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    for i in range(K):
        axis, kind = rng.normal(size=3), KINDS[i % len(KINDS)]
        joint = kind(axis / np.linalg.norm(axis)) if "Unaligned" in kind.__name__ else kind()
        parent = rng.choice([j for j in model.supports[model.njoints - 1] if j > 0])  # depth first, as Pinocchio asks
        model.addJoint(int(parent), joint, pin.SE3.Random(), f"joint_{i}")
    for i in range(1, model.njoints):
        model.inertias[i] = pin.Inertia.Random()
    model.gravity = pin.Motion.Zero()
    return model


def test_dynamics_are_pinocchio_s(arm):
    rng = np.random.default_rng(1)
    joints = tuple(rng.permutation([f"joint_{i}" for i in range(K)]))
    q, v, a = rng.normal(size=(3, N, K))
    root, data = rng.normal(size=(N, 18)), arm.createData()
    found, columns = (
        dynamics_along(tree_of(arm, joints), q, v, a, root, regressors=True),
        [arm.joints[arm.getJointId(name)].idx_v for name in joints],
    )
    masses = (10 * np.arange(1, K + 1)[:, None] + np.arange(4)).ravel()
    for i in range(N):
        step, rate, push = np.zeros((3, arm.nv))
        step[columns], rate[columns], push[columns] = q[i], v[i], a[i]
        rate[:6], push[:6] = root[i, :6], root[i, 6:12]
        outside = [pin.Force.Zero()] * (arm.njoints - 1) + [pin.Force(root[i, 12:])]
        at = pin.integrate(arm, pin.neutral(arm), step)
        torque = pin.rnea(arm, data, at, rate, push, outside)
        expected = [torque[columns], torque[:6], data.f[2].angular[:2].copy()]
        H = np.triu(pin.crba(arm, data, at))
        H += np.triu(H, 1).T
        Y = pin.computeJointTorqueRegressor(arm, data, at, rate, push)[columns][:, masses]
        expected += [H[np.ix_(columns, columns)], H[:6, :6], H[:6, columns].T, Y]
        M, P = found.inertia[:, :K, :K], found.coupling[:, :K]
        ours = (found.torque, found.root, found.moment, M, found.composite, P, found.regressor)
        for x, y in zip(ours, expected, strict=True):
            np.testing.assert_allclose(x[i], y, rtol=1e-12, atol=1e-12 * np.abs(y).max())


def test_a_sample_alone_is_that_of_many(arm):
    tree, (q, v, a) = (
        tree_of(arm, tuple(f"joint_{i}" for i in range(K))),
        np.random.default_rng(2).normal(size=(3, N, K)),
    )
    many = dynamics_along(tree, q, v, a, np.ones((1, 12)))
    one = dynamics_along(tree, q[3:4], v[3:4], a[3:4], np.ones((1, 12)))
    assert (one.torque[0] == many.torque[3]).all() and one.regressor.shape == (1, K, 0)


def test_stiffness_is_how_weight_grows_with_position(arm):
    joints, rng = tuple(f"joint_{i}" for i in range(K)), np.random.default_rng(3)
    q, still, a_0, data = rng.normal(size=K), np.zeros(K), rng.normal(size=3), arm.createData()
    root = np.concatenate([np.zeros(6), a_0, np.zeros(3)])[None]
    found = dynamics_along(tree_of(arm, joints), q[None], still[None], still[None], root).stiffness[0, :K, :K]
    held = arm.copy()
    held.gravity = pin.Motion(-a_0, np.zeros(3))
    columns = [arm.joints[arm.getJointId(name)].idx_v for name in joints]
    step = np.zeros(arm.nv)
    step[columns] = q
    expected = pin.computeGeneralizedGravityDerivatives(held, data, pin.integrate(arm, pin.neutral(arm), step))
    np.testing.assert_allclose(found, expected[np.ix_(columns, columns)], atol=1e-11)


def test_the_wrench_that_moves_the_last_body_is_pinocchio_s(arm):
    joints, rng = tuple(f"joint_{i}" for i in range(K)), np.random.default_rng(4)
    (q, v, a), root, data = rng.normal(size=(3, N, K)), rng.normal(size=(N, 12)), arm.createData()
    found = last_wrench(tree_of(arm, joints), q, v, a, root)
    columns = [arm.joints[arm.getJointId(name)].idx_v for name in joints]
    for i in range(N):
        step, rate, push = np.zeros((3, arm.nv))
        step[columns], rate[columns], push[columns] = q[i], v[i], a[i]
        rate[:6], push[:6] = root[i, :6], root[i, 6:]
        at = pin.integrate(arm, pin.neutral(arm), step)
        pin.forwardKinematics(arm, data, at)
        pin.rnea(arm, data, at, rate, push)
        expected = data.oMi[1].actInv(data.oMi[arm.njoints - 1]).act(data.f[arm.njoints - 1])
        np.testing.assert_allclose(found[i], expected.vector, rtol=1e-11, atol=1e-11)


def test_what_leans_resists_as_its_moment_shows(arm):
    """Moments of a robot at rest by accelerations of one joint, or of the root, of which a lean is one."""
    joints, tree = (names := tuple(f"joint_{i}" for i in range(K))), tree_of(arm, names)
    q, still, data = np.random.default_rng(5).normal(size=K), np.zeros((1, K)), arm.createData()
    found, nothing = dynamics_along(tree, q[None], still, still, np.zeros((1, 12))), np.zeros(6)

    def moment(a: np.ndarray, root: np.ndarray) -> np.ndarray:
        return dynamics_along(tree, q[None], still, a[None], np.concatenate([nothing, root])[None]).moment[0]

    by_joints = np.array([moment(a, nothing) for a in np.eye(K)])
    by_root = np.array([moment(still[0], a) for a in np.eye(6)])
    np.testing.assert_allclose(found.inertia[0, K:, :K], by_joints.T, atol=1e-12)
    np.testing.assert_allclose(found.coupling[0, K:], by_root.T, atol=1e-12)
    step = np.zeros(arm.nv)
    step[[arm.joints[arm.getJointId(name)].idx_v for name in joints]] = q
    pin.forwardKinematics(arm, data, pin.integrate(arm, pin.neutral(arm), step))
    leans = np.array([data.oMi[1].actInv(data.oMi[2]).act(pin.Motion(np.eye(6)[3 + c])).vector for c in range(2)])
    np.testing.assert_allclose(found.inertia[0, K:, K:], leans @ by_root, atol=1e-12)
    assert (found.inertia[0] == found.inertia[0].T).all() and (found.stiffness[0, K:] == 0.0).all()
