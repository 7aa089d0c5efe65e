"""A base on its wheels and a link that strikes in its gap on it, against forward dynamics of both by Pinocchio."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from pinocchio import SE3

from calibration.stages.drive_trains import DriveTrain, DriveTrains
from calibration.stages.drive_trains.drive_trains import prepared
from calibration.stages.drive_trains.torques import Dynamics
from calibration.stages.stick_slip.forcing import STEP, STEPS
from calibration.stages.stick_slip.kernel.bases import COLUMNS
from calibration.stages.stick_slip.kernel.together import Carried, left, walked
from calibration.stages.stick_slip.likelihood import bases_of
from tests.calibration.stages.stick_slip.slipping import TRUTH, WEIGHT, WHEELS, across

GAP, C, COULOMB, VISCOUS, LAG = 2e-3, 2e-4, 0.5, 0.4, 6e-3
STUCK = replace(TRUTH, drive_mu=1e3, front_mu=1e3, back_mu=1e3, body_c=1e-9, body_cr=1e-9)
ON_WHEELS = replace(WHEELS, weight=np.zeros(6), radius=np.zeros(6))
PARTS = 60  # steps of the reference in one of the kernel
HAND, REACH = 2.0, np.array([0.7, 0.1, 0.0])  # [kg] and where it is on the arm [m]


def robot(hand: float = 0.0) -> pin.Model:
    """A base that moves in the plane, an arm that reaches out of it, and a hand [kg]: they throw each other."""
    model, at = pin.Model(), 0
    for joint in (pin.JointModelPX(), pin.JointModelPY(), pin.JointModelRZ()):
        at = model.addJoint(at, joint, SE3.Identity(), f"base_{at}")
    model.appendBodyToJoint(at, pin.Inertia(50.0, np.array([-0.1, 0.02, 0.3]), np.eye(3)), SE3.Identity())
    arm = model.addJoint(at, pin.JointModelRZ(), SE3(np.eye(3), np.array([0.2, -0.02, 0.8])), "arm")
    model.appendBodyToJoint(arm, pin.Inertia(6.0, np.array([0.5, 0.0, 0.0]), 0.1 * np.eye(3)), SE3.Identity())
    model.appendBodyToJoint(arm, pin.Inertia(hand, REACH, np.zeros((3, 3))), SE3.Identity())
    model.addFrame(pin.Frame("hand", arm, SE3(np.eye(3), REACH), pin.FrameType.OP_FRAME))
    model.gravity = pin.Motion.Zero()
    return model


def motor(t: np.ndarray) -> np.ndarray:
    """q, v, a (3, n): a jolt of 0.8 rad in 0.7 s, and back."""
    found = np.zeros((3, *np.shape(t)))
    for start, size in ((0.2, 0.8), (1.2, -0.8)):
        s = np.clip((t - start) / 0.7, 0.0, 1.0)
        found += size * np.array(
            [s**3 * (10 - 15 * s + 6 * s**2), 30 * s**2 * (1 - s) ** 2 / 0.7, 60 * s * (1 - s) * (1 - 2 * s) / 0.49]
        )
    return found


def reference(t: np.ndarray, hand: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, y, yaw (n, 3) of the base and delta (n,) of the link at times t, by forward dynamics of both.

    And what a hand does to the base (n, 3), in its axes.
    """
    model, rows, h = robot(hand), ON_WHEELS.rows(STUCK), STEP / PARTS
    data, q, v = model.createData(), np.zeros(4), np.zeros(4)
    A = [across(place) for place in rows[:, :2]]
    K = sum(a.T @ np.diag(row[2:4]) @ a for a, row in zip(A, rows, strict=True))
    B = sum(row[4] * a.T @ a for a, row in zip(A, rows, strict=True))
    angle, rate, _ = motor(h * np.arange(PARTS * len(t)))
    x, delta, pushes = np.empty((len(t), 3)), np.empty(len(t)), np.empty((len(t), 3))
    for i in range(PARTS * len(t)):
        ahead = angle[i] - q[3]
        beyond = ahead - np.clip(ahead, -GAP, GAP)
        mesh = (beyond + np.where(beyond != 0.0, LAG * (rate[i] - v[3]), 0.0)) / C
        torque = mesh - COULOMB * np.tanh(v[3] / 1e-3) - VISCOUS * v[3]
        a = pin.aba(model, data, q, v, np.append(-K @ q[:3] - B @ v[:3], torque))
        if i % PARTS == 0:
            x[i // PARTS], delta[i // PARTS] = q[:3], angle[i] - q[3]
            pushes[i // PARTS] = pushed(model, data, hand, q, v, a)
        v = v + h * a
        q = q + h * v
    return x, delta, pushes


def pushed(model, data, hand, q, v, a) -> np.ndarray:
    """Fx, Fy, Mz by which a hand pushes the base, in its axes."""
    k = model.getFrameId("hand")
    pin.forwardKinematics(model, data, q, v, a)
    at = pin.updateFramePlacement(model, data, k).translation - data.oMi[3].translation
    force = -hand * pin.getFrameClassicalAcceleration(model, data, k, pin.LOCAL_WORLD_ALIGNED).linear
    in_base = data.oMi[3].rotation.T
    return np.array([*(in_base @ force)[:2], np.cross(in_base @ at, in_base @ force)[2]])


def ours(
    t: np.ndarray, coupled: float = 1.0, hand: float = 0.0, pushes: float | np.ndarray = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """x and delta by the kernel, the link and the base coupled by a share of what couples them.

    Of a hand is known what it does to the base.
    """
    model, loaded, n = robot(), robot(hand), len(t)
    data, samples, M = model.createData(), np.empty((n, 4, 1)), np.empty((n, 1, 1))
    P, R, with_hand = np.empty((n, 1, 3)), np.empty((n, 1, 3)), loaded.createData()
    drive, inertia = np.zeros((n, COLUMNS)), np.zeros((n // STEPS, 15))
    drive[:, 3:6] = WEIGHT
    for k, (q, v, a) in enumerate(motor(t).T):
        at, rate, push = (np.array([0.0, 0.0, 0.0, value]) for value in (q, v, a))
        H, of_link = pin.crba(model, data, at), pin.crba(loaded, with_hand, at)
        drive[k, :3] = -pin.rnea(model, data, at, rate, push)[:3]
        samples[k, :, 0] = q, v, pin.rnea(loaded, with_hand, at, rate, push)[3], of_link[3, 3]
        M[k], P[k], R[k] = of_link[3, 3], coupled * H[:3, 3], coupled * of_link[:3, 3]
        inertia[k // STEPS, :6] = H[:3, :3][np.triu_indices(3)]
    drive[:, :3] += pushes
    free = pin.Model()
    free.addJoint(
        free.addJoint(0, pin.JointModelFreeFlyer(), SE3.Identity(), "root"), pin.JointModelRZ(), SE3.Identity(), "arm"
    )
    train = DriveTrain("arm", "dead_zone", np.array([GAP, C, COULOMB, VISCOUS, LAG, 0.0, 0.0]), dynamic=True)
    trains = DriveTrains(Dynamics(free, ("arm",), np.zeros(1), np.zeros(3)), (train,), "", None)  # type: ignore[arg-type]
    of = Carried(np.zeros((1, 1, 3)), samples, np.arange(n), M, 0.0 * M, P, R, prepared(trains))
    x, delta = walked(bases_of(ON_WHEELS, STUCK.logarithms[None], False), drive, inertia, of, STEP)
    return x, delta[:, 0]


@pytest.fixture(scope="module")
def moved() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    t = STEP * np.arange(3 * 250)
    return t, *reference(t)[:2]


def test_a_link_that_strikes_throws_the_base_and_is_thrown_by_it(moved):
    t, x, delta = moved
    own, behind = ours(t)
    alone, rigid = ours(t, coupled=1e-9)
    far = np.abs(own - x[STEPS - 1 :: STEPS]).max(axis=0)[[1, 2]]
    assert np.all(far < 0.05 * np.abs(x).max(axis=0)[[1, 2]]), far
    assert np.sqrt(((behind - delta) ** 2).mean()) < 0.03 * np.abs(delta).max()
    assert np.abs(alone - x[STEPS - 1 :: STEPS])[:, 2].max() > 0.15 * np.abs(x[:, 2]).max()  # what it is for
    assert np.sqrt(((rigid - delta) ** 2).mean()) > 0.15 * np.abs(delta).max()


def test_a_hand_whose_sensor_shows_what_it_does_to_the_base_loads_the_link_alone():
    t = STEP * np.arange(3 * 250)
    x, delta, pushes = reference(t, HAND)
    own, behind = ours(t, hand=HAND, pushes=pushes)
    assert np.all(np.abs(own - x[STEPS - 1 :: STEPS]).max(axis=0)[[1, 2]] < 0.05 * np.abs(x).max(axis=0)[[1, 2]])
    assert np.sqrt(((behind - delta) ** 2).mean()) < 0.03 * np.abs(delta).max()


def test_what_a_base_leaves_a_link_is_what_the_rest_of_the_matrix_leaves():
    """Schur's complement: accelerations of links under a torque are those of links and base together."""
    rng = np.random.default_rng(0)
    root = rng.normal(size=(5, 5))
    H, torque = root @ root.T + 5.0 * np.eye(5), rng.normal(size=2)
    M, P, sample = H[3:, 3:].copy(), H[3:, :3].copy(), np.zeros((4, 2))
    sample[3], a = np.diag(M), rng.normal(size=3)
    yields = left(sample, M, (P, P), H[:3, :3][np.triu_indices(3)], a, np.arange(2))
    np.testing.assert_allclose(np.linalg.solve(M, torque), np.linalg.solve(H, np.append(np.zeros(3), torque))[3:])
    np.testing.assert_allclose(yields, np.linalg.solve(H[:3, :3], P.T).T)
    np.testing.assert_allclose(sample[3], np.diag(M))
    np.testing.assert_allclose(sample[2], P @ a)
