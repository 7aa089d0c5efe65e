"""A column that bends under the arm that it carries sways as the arm moves, against forward dynamics by Pinocchio."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from calibration.stages.drive_trains import DriveTrain, DriveTrains, drive_trains, stream_of
from calibration.stages.drive_trains.torques import STIFF, Column, Dynamics, LinkLoads

SOFT, C, LAG, REACH = np.array([8e-5, 9e-5]), 1.1e-4, 2e-3, np.array([0.15, 0.0, 0.6])
HAND = pin.Inertia(6.0, np.array([0.5, 0.1, 0.1]), 0.05 * np.eye(3))
VALUES = np.array([0.0, C, 0.0, 0.0, LAG, 1.0, 0.0])
STEP, EVERY = 1e-4, 100  # [s] of the reference, and its steps in a sample


def arm(leans: bool) -> pin.Model:
    """A lift that stands and carries a joint about y; between them the column's two hinges, or none; no gravity."""
    model = pin.Model()
    at = 0 if leans else model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    at = model.addJoint(at, pin.JointModelPZ(), pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.8])), "lift")
    for name, joint in (("x", pin.JointModelRX()), ("y", pin.JointModelRY())) if leans else ():
        at = model.addJoint(at, joint, pin.SE3.Identity(), name)
    model.appendBodyToJoint(at, pin.Inertia(9.0, np.array([0.0, 0.02, 0.3]), 0.2 * np.eye(3)), pin.SE3.Identity())
    at = model.addJoint(at, pin.JointModelRY(), pin.SE3(np.eye(3), REACH), "arm")
    model.appendBodyToJoint(at, HAND, pin.SE3.Identity())
    model.gravity = pin.Motion.Zero()
    return model


def motor(t: np.ndarray) -> np.ndarray:
    """q, v, a (3, n) of the arm: it moves by 20 mrad and stops within a tenth of a second."""
    s, moves = np.clip(t / 0.1, 0.0, 1.0), t < 0.1
    q = 0.02 * (s - np.sin(2.0 * np.pi * s) / (2.0 * np.pi))
    v, a = 0.2 * (1.0 - np.cos(2.0 * np.pi * s)), 4.0 * np.pi * np.sin(2.0 * np.pi * s)
    return np.array([q, np.where(moves, v, 0.0), np.where(moves, a, 0.0)])


def reference(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """delta (n,) of the arm and leans (n, 2)."""
    model = arm(leans=True)
    data, q, v, found = model.createData(), np.zeros(4), np.zeros(4), np.empty((len(t), 3))
    at, rate, _ = motor(STEP * np.arange(EVERY * len(t)))
    for i in range(EVERY * len(t)):
        if i % EVERY == 0:
            found[i // EVERY] = at[i] - q[3], *q[1:3]
        mesh = (at[i] - q[3] + LAG * (rate[i] - v[3])) / C
        H = pin.crba(model, data, q)
        H = np.triu(H) + np.triu(H, 1).T
        force = np.array([*(-q[1:3] / SOFT), mesh]) - pin.nle(model, data, q, v)[1:]
        v[1:] += STEP * np.linalg.solve(H[1:, 1:], force)
        q = q + STEP * v
    return found[:, 0], found[:, 1:]


@pytest.fixture(scope="module")
def swaying() -> tuple[np.ndarray, np.ndarray, DriveTrains, LinkLoads]:
    t = STEP * EVERY * np.arange(60)
    robot = Dynamics(arm(leans=False), ("lift", "arm"), np.zeros(2), np.zeros(3), Column(SOFT, np.zeros(2)))
    q, v, a = (np.column_stack([0.0 * x, x]) for x in motor(t))
    loads = LinkLoads("", t, q, q, v, a, *robot.evaluated(q, v, a, None))
    train = DriveTrain("arm", "dead_zone", VALUES, start=(0.5, 0.0))
    return *reference(t), DriveTrains(robot, (train,), "", None), loads  # type: ignore[arg-type,return-value]


def test_a_column_sways_and_moves_the_link(swaying, monkeypatch):
    true, leans, of, loads = swaying
    monkeypatch.setattr(drive_trains, "LONGEST", 1e-4)  # steps as long as they are take a third of the sway in a tenth
    found = of.of_loads(loads)
    delta = loads.q[:, 1] - found.q[:, 1]
    rigid = replace(of, dynamics=replace(of.dynamics, column=STIFF))
    alone = loads.q[:, 1] - rigid.likely(loads)[:, 1]
    size, lean = np.abs(true).max(), np.abs(leans).max()
    assert np.sqrt(((delta - true) ** 2).mean()) < 0.05 * size
    assert np.sqrt(((alone - true) ** 2).mean()) > 0.5 * size  # what a column that does not bend leaves
    assert np.sqrt(((-SOFT * found.moment - leans) ** 2).mean()) < 0.05 * lean
    assert np.sqrt(((-SOFT * loads.moment - leans) ** 2).mean()) > 0.3 * lean  # a column that leans at once


def test_it_sways_sample_by_sample_as_all_at_once(swaying):
    _, _, of, loads = swaying
    batch, stream = of.of_loads(loads), stream_of(of)
    state, angles = stream.begin(loads.t[0], np.array([loads.q[0], loads.v[0], loads.a[0]]))
    found = [angles]
    for i in range(1, len(loads.t)):
        state, angles = stream.step(state, loads.t[i], np.array([loads.q[i], loads.v[i], loads.a[i]]))
        found.append(angles)
    assert np.abs(np.concatenate([x.q for x in found]) - batch.q).max() < 1e-12
    assert np.abs(np.concatenate([x.moment for x in found]) - batch.moment).max() < 1e-7 * np.abs(batch.moment).max()


def test_a_column_whose_compliance_is_not_positive_leans_at_once(swaying):
    _, _, of, loads = swaying
    odd = replace(of, dynamics=replace(of.dynamics, column=Column(SOFT * [1.0, -1.0], np.zeros(2))))
    found = odd.of_loads(loads)
    assert (found.moment == loads.moment).all() and odd.swaying(loads).shape == loads.q.shape
