import numpy as np
import pinocchio as pin
import pytest

from calibration.errors import NotEnoughData
from calibration.numerics.lie import exp6, from_vector, to_vector
from calibration.prediction.compensator import Compensator
from calibration.prediction.second_session import changes, reregistered_compensator, session_of
from calibration.recording.schema import Description
from calibration.robot.chain import chain_of
from calibration.robot.hand import nominal_hand
from calibration.robot.hand_uncertainty import Session
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.geometry.registration import fit_frames
from tests.doubles.rigid_robot import with_values

MARKERS = np.array([[0.1, 0.0, 0.05], [-0.05, 0.1, 0.1]])


@pytest.fixture(scope="module")
def description(dataset):
    return dataset.description


@pytest.fixture(scope="module")
def hand(dataset, description: Description):
    chain = chain_of(dataset.urdf, description)
    return nominal_hand(chain, nominal_frames(chain, description))


def postures(n, n_joints, seed=1):
    return np.random.default_rng(seed).uniform(-0.6, 0.6, size=(n, n_joints)) + 0.2


def test_remounted_markers_are_found_where_they_are(hand, description):
    rng = np.random.default_rng(2)
    moved = with_values(hand, base=hand.base + 3e-3 * rng.normal(size=6), hand=hand.hand + 8e-3 * rng.normal(size=6))
    q = postures(8, len(description.joints))
    found = fit_frames(hand, q, moved.poses(q), description)
    np.testing.assert_allclose(found.base, moved.base, atol=1e-9)
    np.testing.assert_allclose(found.hand, moved.hand, atol=1e-9)
    np.testing.assert_array_equal(found.theta[12:], hand.theta[12:])


def test_what_is_left_of_the_markers_is_smallest(hand, description):
    """No small move of either frame brings the hand's markers closer to noisy poses' ones."""
    rng, q = np.random.default_rng(3), postures(8, len(description.joints))
    noise = [pin.exp6(1e-3 * rng.normal(size=6)).homogeneous for _ in q]
    T = hand.poses(q) @ np.array(noise)
    markers = np.array([m.xyz for m in description.hand_body.markers])

    def misfit(model):
        error = [pin.log6(pin.SE3(E)).vector for E in np.linalg.inv(T) @ model.poses(q)]
        return sum(np.sum((e[:3] + np.cross(e[3:], markers)) ** 2) for e in error)

    best = fit_frames(hand, q, T, description)
    for k in range(12):
        step = 1e-4 * np.eye(12)[k]
        for sign in (1.0, -1.0):
            other = with_values(best, base=best.base + sign * step[:6], hand=best.hand + sign * step[6:])
            assert misfit(other) > misfit(best)


def test_postures_that_cannot_tell_both_frames_are_refused(hand, description):
    q = postures(8, len(description.joints))
    with pytest.raises(NotEnoughData, match="0 registration postures"):
        fit_frames(hand, q[:0], np.empty((0, 4, 4)), description)
    turned = np.repeat(q[:1], 6, axis=0)
    turned[:, 1] += np.linspace(0.0, 0.5, 6)
    with pytest.raises(NotEnoughData, match="about one direction only"):
        fit_frames(hand, turned, hand.poses(turned), description)


def test_widths_of_another_day_are_those_that_registrations_showed(hand):
    """Of two days of three values each: squares over four, not six."""
    rng, true = np.random.default_rng(4), Session((1e-3, 2e-3), (5e-4, 5e-3))
    days = []
    for _ in range(400):
        x = rng.normal(size=12) * np.sqrt(true.variances)
        frames = [
            to_vector(from_vector(f) @ exp6(d)) for f, d in zip((hand.base, hand.hand), x.reshape(2, 6), strict=True)
        ]
        days.append(changes(hand, with_values(hand, base=frames[0], hand=frames[1])))
        np.testing.assert_allclose(days[-1], x.reshape(2, 6), atol=1e-12)
    np.testing.assert_allclose(session_of(days).variances, true.variances, rtol=0.2)
    wider = session_of(days[:2]).variances.sum() / np.square(days[:2]).sum(axis=(0, 2)).sum()
    assert wider == pytest.approx(3.0 / 4.0)


@pytest.mark.slow
def test_frames_of_few_postures_are_as_uncertain_as_the_same_fit_repeated_shows(hand, description):
    """Geometry off by its own covariance, readings by their random errors: the markers' errors at other postures."""
    rng, q, other = (
        np.random.default_rng(5),
        postures(5, len(description.joints)),
        postures(3, len(description.joints), 2),
    )
    k, p = len(hand.offset), 12 + 7 * len(hand.offset)
    sigma = np.r_[np.full(12, 9.0), np.full(6 * k, 4e-4), np.full(k, 1e-3)]  # of the old frames: no matter
    robot = Compensator(hand, hand.names[:p], np.diag(sigma**2), np.full(k, 2e-3), np.array([2e-4, 1e-3]))
    found = reregistered_compensator(robot, q, hand.poses(q), description)
    stated = found.points(MARKERS, other)
    errors = []
    for _ in range(300):
        true = hand.with_theta(
            hand.theta[:p] + np.r_[np.zeros(12), sigma[12:] * rng.normal(size=p - 12)], hand.names[:p]
        )
        T = [moved_hand(true, x, robot, rng) for x in (q, other)]
        again = reregistered_compensator(robot, q, T[0], description)
        seen = np.einsum("nij,mj->nmi", T[1][:, :3, :3], MARKERS) + T[1][:, None, :3, 3]
        errors.append(again.points(MARKERS, other).positions - seen)
    drawn = np.einsum("snmi,snmj->nmij", errors, errors) / len(errors)
    trace = np.trace(stated.covariance, axis1=2, axis2=3)
    np.testing.assert_allclose(np.trace(drawn, axis1=2, axis2=3), trace, rtol=0.15)
    np.testing.assert_allclose(drawn, stated.covariance, atol=0.1 * trace.max())


def moved_hand(true, q, robot, rng):
    """Poses (n, 4, 4) of the hand, readings and hand off by their random errors."""
    T = true.poses(q + robot.reading_sigma * rng.normal(size=q.shape))
    sigma = np.sqrt(robot.spread.hand_variances)
    return np.array([M @ pin.exp6(sigma * rng.normal(size=6)).homogeneous for M in T])
