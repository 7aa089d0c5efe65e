"""Calibration from arrays: matched truth, outliers, refusals."""

from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration.errors import NotCalibrated, NotEnoughData, ShapeError
from calibration.mocap.cluster_shape import cluster
from calibration.numerics.alignment import registration_start
from calibration.robot.chain import chain_of_frames
from calibration.robot.hand_uncertainty import Session
from calibration.stages.geometry import from_arrays
from calibration.stages.geometry.cross_validation import LeftOut
from calibration.stages.geometry.from_arrays import GeometryFit, Widths, fit_chain
from calibration.stages.geometry.parameters import reading_names
from tests.doubles import rigid_robot
from tests.doubles.real_postures import KINDS, spoilt

TOOL = "gripper_grasping_frame"
X = np.array(rigid_robot.BODIES["gripper"][1])
FEW = X[:1]
LAB = rigid_robot.se3(np.array([0.9, 0.5, 0.1, 0.02, -0.01, 1.2]))


def markers(truth, q, sigma, seed=0, xyz=X):
    """Marker positions (n, m, 3) [m] in a laboratory nobody has declared, at joint angles q."""
    T = LAB @ rigid_robot.hand_in_base(truth, q)
    p = np.einsum("nij,mj->nmi", T[:, :3, :3], xyz) + T[:, None, :3, 3]
    return p + sigma * np.random.default_rng(seed).normal(size=p.shape)


def fitted(q, positions, tool=TOOL) -> GeometryFit:
    return fit_chain(chain_of_frames(mjcf.urdf(), rigid_robot.JOINTS, "base_footprint", tool), q, positions, Widths())


@pytest.fixture(scope="module")
def good():
    """Readings and four markers of a robot whose wrist has play, and its truth."""
    truth = rigid_robot.defects(1)
    q = rigid_robot.near_postures(np.random.default_rng(1), 40)
    gaps = np.array([0.0, 1.0, 1.0, 1.5, 1.5, 3.0, 12.0, 10.0]) * 1e-3
    moved = q + np.random.default_rng(2).uniform(-1.0, 1.0, size=q.shape) * gaps
    return q + truth.offset, markers(truth, moved, 2e-4), truth


@pytest.mark.parametrize("xyz", [X, FEW], ids=["four markers", "one marker"])
def test_without_noise_every_marker_is_predicted_to_1e_8(xyz):
    truth = rigid_robot.defects(2)
    q = rigid_robot.random_angles(np.random.default_rng(1), 60)
    found = fitted(q + truth.offset, markers(truth, q, 0.0, xyz=xyz))
    new = rigid_robot.random_angles(np.random.default_rng(2), 200)
    np.testing.assert_allclose(found.predict(new + truth.offset), markers(truth, new, 0.0, xyz=xyz), atol=1e-8)
    assert found.left_out == ()


def test_the_shape_of_a_cluster_is_found_in_its_own_handedness(good):
    found = cluster(good[1])
    expected = np.linalg.norm(X[:, None] - X[None], axis=2)
    np.testing.assert_allclose(np.linalg.norm(found.xyz[:, None] - found.xyz[None], axis=2), expected, atol=2e-4)
    assert np.linalg.det(found.xyz[1:] - found.xyz[0]) * np.linalg.det(X[1:] - X[0]) > 0.0
    assert found.sigma == pytest.approx(2e-4, rel=0.1)


def test_the_start_of_a_nominal_robot_is_exact(chain):
    q = rigid_robot.random_angles(np.random.default_rng(1), 12)
    T = LAB @ rigid_robot.hand_in_base(rigid_robot.Truth(), q)
    found = registration_start(chain.poses(q), T, True)
    np.testing.assert_allclose(rigid_robot.se3(found.frames[:6]), np.linalg.inv(LAB), atol=1e-10)
    np.testing.assert_allclose(found.frames[6:], 0.0, atol=1e-10)
    assert found.scale == pytest.approx(1.0, abs=1e-9)


def test_markers_that_were_not_seen_are_no_error(good):
    q, positions, truth = good
    positions = positions.copy()
    positions[3, 1] = np.nan
    positions[5] = np.nan
    found = fitted(q, positions)
    assert found.left_out == (5,)
    new = rigid_robot.near_postures(np.random.default_rng(9), 50)
    assert np.sqrt(((found.predict(new + truth.offset) - markers(truth, new, 0.0)) ** 2).mean()) < 1.5e-3


@pytest.mark.parametrize("kind", KINDS)
def test_four_wrong_postures_of_forty_are_named_and_change_nothing(good, kind):
    q, positions, _ = good
    rng = np.random.default_rng(3)
    rows = np.sort(rng.choice(40, 4, replace=False))
    found = fitted(q, spoilt(positions, rows, kind, rng))
    assert found.left_out == tuple(rows)
    assert any(", ".join(map(str, rows)) in v.message for v in found.verdicts if v.verdict == "warning")
    rest = np.setdiff1d(np.arange(40), rows)
    without = fitted(q[rest], positions[rest])
    np.testing.assert_allclose(found.predict(q), without.predict(q), atol=1e-4)


def reasons(*arguments, **named) -> str:
    with pytest.raises(NotCalibrated) as caught:
        fitted(*arguments, **named)
    return " | ".join(caught.value.reasons)


@pytest.mark.parametrize("m", [4, 1])
def test_wrong_units_mirrors_orders_and_frames_are_refused(good, m):
    q, p = good[0], good[1][:, :m]
    degrees = np.hstack([q[:, :1], np.degrees(q[:, 1:])])
    orders = {4: ([0, 1, 3, 2, 4, 5, 6, 7], list(range(7, -1, -1))), 1: ([0, 1, 2, 3, 4, 5, 7, 6],)}
    assert "millimetres" in reasons(q, 1e3 * p)
    assert "degrees" in reasons(degrees, p)
    assert "mirror" in reasons(q, p * [1.0, -1.0, 1.0])
    for columns in orders[m]:
        assert reasons(q[:, columns], p)
    assert reasons(q, p, tool="arm_5_link")


@pytest.mark.parametrize("m", [4, 1])
def test_too_little_is_refused(good, m):
    q, p = good[0], good[1][:, :m]
    assert "3 distinct postures" in reasons(q[:3], p[:3])
    shaken = np.random.default_rng(4).normal(size=(36, 8 + 3 * m)) * 1e-4
    again = np.repeat(p[:3], 12, axis=0) + shaken[:, 8:].reshape(36, m, 3)
    assert "3 distinct postures among 36" in reasons(np.repeat(q[:3], 12, axis=0) + shaken[:, :8], again)


def test_broken_orientations_are_refused(good):
    q, p = good[0], good[1].copy()
    for k, seed in enumerate(range(40)):
        centre = p[k].mean(axis=0)
        turn = rigid_robot.se3(np.r_[np.zeros(3), np.random.default_rng(seed).uniform(-2.0, 2.0, 3)])[:3, :3]
        p[k] = (p[k] - centre) @ turn.T + centre
    assert "rotation [rad] scatters" in reasons(q, p)


def test_arrays_that_do_not_belong_together_are_refused(good):
    with pytest.raises(ShapeError, match="positions"):
        fitted(good[0][:10], good[1])
    with pytest.raises(NotEnoughData, match="in line"):
        fitted(good[0], good[1][:, :2])


def test_intervals_are_as_wide_as_errors_left_out(good, monkeypatch):
    left = LeftOut("full", np.full(40, 3e-3), np.full(40, 2e-3), 1e-3)
    monkeypatch.setattr(from_arrays, "errors_left_out", lambda *_: left)
    found = from_arrays.fit_geometry(mjcf.urdf(), rigid_robot.JOINTS, TOOL, *good[:2], "base_footprint")
    alone = fitted(good[0], good[1])
    radii = [f.predict_with_covariance(good[0]).radius_95 for f in (found, alone)]
    np.testing.assert_allclose(radii[0], 1.5 * radii[1])
    assert "3.00 mm rms" in found.verdicts[-1].message and "multiplied by 1.50" in found.verdicts[-1].message


def test_another_session_has_a_wider_band(good):
    found = fitted(good[0], good[1])
    within, between = (found.predict_with_covariance(good[0], s).covariance for s in (None, Session()))
    assert (np.linalg.eigvalsh(between - within) > 0.0).all()
    error = found.predict(good[0]) - good[1]
    z2 = np.einsum("nmi,nmij,nmj->nm", error, np.linalg.inv(within), error)
    assert 0.85 < (z2 < 7.815).mean() <= 1.0


def test_the_predicted_covariance_is_that_of_its_parameters_and_errors(good):
    found = fitted(good[0], good[1])
    q, k = good[0][:1], 8
    at, step = found.fit.theta, 1e-6
    J = np.array(
        [
            (
                found.hand.with_theta(at + d, found.parameters.names).poses(q)
                - found.hand.with_theta(at - d, found.parameters.names).poses(q)
            )[0]
            / (2.0 * step)
            for d in step * np.eye(len(at))
        ]
    )
    moved = np.einsum("pij,mj->mpi", J[:, :3, :3], found.markers) + J[:, :3, 3]
    expected = np.einsum("mpi,pq,mqj->mij", moved, found.fit.covariance, moved)
    bare = replace(found.fit.widths, noise=np.zeros_like(found.fit.widths.noise))
    alone = replace(found, fit=replace(found.fit, widths=bare))
    assert len(found.fit.noise_sigma(reading_names(found.hand.nominal))) == k
    np.testing.assert_allclose(alone.predict_with_covariance(q).covariance[0], expected, rtol=1e-4, atol=1e-14)
