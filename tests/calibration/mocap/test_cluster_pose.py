import numpy as np
import pinocchio as pin
import pytest

from calibration.errors import ShapeError
from calibration.mocap.cluster_pose import body_poses
from calibration.numerics.lie import compose
from tests.doubles import rigid_robot

XYZ = np.array(rigid_robot.BODIES["gripper"][1])


def random_poses(rng: np.random.Generator, n: int) -> np.ndarray:
    return np.array([rigid_robot.se3(np.r_[rng.normal(size=3), rng.uniform(-2.0, 2.0, size=3)]) for _ in range(n)])


def positions(T: np.ndarray) -> np.ndarray:
    return np.einsum("nij,mj->nmi", T[:, :3, :3], XYZ) + T[:, None, :3, 3]


def test_a_rigid_cluster_gives_its_pose_back():
    T = random_poses(np.random.default_rng(0), 50)
    found = body_poses(XYZ, positions(T))
    np.testing.assert_allclose(found.T, T, atol=1e-14)
    np.testing.assert_allclose(found.residual, 0.0, atol=1e-14)


def test_hidden_markers_do_not_count_and_two_are_not_enough():
    T = random_poses(np.random.default_rng(1), 3)
    p = positions(T)
    p[0, 1] = np.nan
    p[1, :2] = np.nan
    found = body_poses(XYZ, p)
    np.testing.assert_allclose(found.T[[0, 2]], T[[0, 2]], atol=1e-14)
    assert np.isnan(found.T[1]).all() and np.isnan(found.covariance[1]).all()
    assert np.isnan(found.residual[0, 1]).all()


def test_markers_on_a_line_fix_no_pose():
    line = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]])
    assert np.isnan(body_poses(line, line[None]).T).all()


def test_a_flat_cluster_is_never_mirrored():
    flat = XYZ * np.array([1.0, 1.0, 0.0])
    p = np.random.default_rng(2).normal(scale=1e-3, size=(20, *flat.shape)) + flat
    R = body_poses(flat, p).T[:, :3, :3]
    np.testing.assert_allclose(np.linalg.det(R), 1.0, atol=1e-12)


def test_the_pose_is_the_least_squares_one():
    rng = np.random.default_rng(3)
    p = positions(random_poses(rng, 1)) + 0.01 * rng.normal(size=(1, *XYZ.shape))
    found = body_poses(XYZ, p)
    best = (found.residual**2).sum()
    for step in 1e-4 * rng.normal(size=(50, 6)):
        T = found.T[0] @ pin.exp6(step).homogeneous
        assert ((p[0] - (XYZ @ T[:3, :3].T + T[:3, 3])) ** 2).sum() > best


@pytest.mark.parametrize("hidden", [(), (1,)])
def test_covariance_of_the_local_twist_is_that_of_monte_carlo(hidden):
    rng, n, sigma = np.random.default_rng(4), 40_000, 1e-4
    T = random_poses(rng, 1)[0]
    p = positions(np.repeat(T[None], n, axis=0)) + sigma * rng.normal(size=(n, *XYZ.shape))
    p[:, list(hidden)] = np.nan
    found = body_poses(XYZ, p)
    error = compose(T[:3, :3].T @ found.T[:, :3, :3], (found.T[:, :3, 3] - T[:3, 3]) @ T[:3, :3])
    twists = np.array([pin.log6(pin.SE3(e)).vector for e in error])
    L = np.linalg.cholesky(sigma**2 * found.covariance[0])
    white = np.linalg.solve(L, np.cov(twists.T)) @ np.linalg.inv(L).T
    np.testing.assert_allclose(white, np.eye(6), atol=0.03)  # 4 standard deviations of a variance over 40,000


def test_positions_of_another_cluster_are_refused():
    with pytest.raises(ShapeError, match="positions"):
        body_poses(XYZ, np.zeros((5, 3, 3)))
