"""Links that strike in their gaps throw each other, against forward dynamics of both by Pinocchio."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from calibration.stages.drive_trains import DriveTrain, DriveTrains, stream_of
from calibration.stages.drive_trains.torques import Dynamics, LinkLoads

URDF = """
<robot name="two"><link name="base"/>
<link name="one"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
<inertia ixx="0.02" iyy="0.02" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="two"><inertial><origin xyz="0.15 0 0"/><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="first" type="revolute"><parent link="base"/><child link="one"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="9" velocity="9"/></joint>
<joint name="second" type="revolute"><parent link="one"/><child link="two"/><origin xyz="0.4 0 0"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="9" velocity="9"/></joint></robot>
"""
GAP, C, COULOMB, VISCOUS, LAG = 8e-3, 5e-4, 0.15, 0.02, 1e-3
VALUES = np.array([GAP, C, COULOMB, VISCOUS, LAG, 0.0, 0.0])
STEP, EVERY = 5e-5, 100  # [s] of the reference, and its steps in a sample
SIZE, RATE = 0.02, 2.0 * np.pi * 1.2  # of the outer motor's swing [rad], [rad/s]; the inner one stands


def motor(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q, v, a (n, 2) at t (n,)."""
    still = np.zeros(len(t))
    outer = SIZE * (1.0 - np.cos(RATE * t)), SIZE * RATE * np.sin(RATE * t), SIZE * RATE**2 * np.cos(RATE * t)
    return tuple(np.column_stack([still, x]) for x in outer)  # type: ignore[return-value]


def reference(t: np.ndarray) -> np.ndarray:
    """Link angles (n, 2) behind both gaps, both links by forward dynamics."""
    model = pin.buildModelFromXML(URDF)
    model.gravity = pin.Motion.Zero()
    data, q, v, found = model.createData(), np.array([0.0, -GAP]), np.zeros(2), np.empty((len(t), 2))
    at, rate, _ = motor(STEP * np.arange(EVERY * len(t)))
    for i in range(EVERY * len(t)):
        if i % EVERY == 0:
            found[i // EVERY] = q
        delta = at[i] - q
        beyond = delta - np.clip(delta, -GAP, GAP)
        mesh = (beyond + np.where(beyond != 0.0, LAG * (rate[i] - v), 0.0)) / C
        torque = mesh - COULOMB * np.tanh(v / 1e-3) - VISCOUS * v
        v = v + STEP * pin.aba(model, data, q, v, torque)
        q = q + STEP * v
    return found


@pytest.fixture(scope="module")
def links() -> tuple[np.ndarray, DriveTrains, LinkLoads]:
    """True link angles (n, 2), the drive trains that predict them, and what loads these."""
    t = STEP * EVERY * np.arange(300)
    model = pin.buildModelFromXML(URDF, pin.JointModelFreeFlyer())
    model.gravity = pin.Motion.Zero()
    robot = Dynamics(model, ("first", "second"), np.zeros(2), np.zeros(3))
    of = (
        DriveTrain("first", "dead_zone", VALUES, start=(0.5, 0.0)),
        DriveTrain("second", "dead_zone", VALUES, start=(1.0, 0.0)),
    )
    q, v, a = motor(t)
    loads = LinkLoads("", t, q, q, v, a, *robot.evaluated(q, v, a, None))
    return reference(t), DriveTrains(robot, of, "", None), loads  # type: ignore[arg-type]


def test_a_strike_of_the_outer_link_throws_the_inner_one_and_is_thrown_back(
    links: tuple[np.ndarray, DriveTrains, LinkLoads],
) -> None:
    true, of, loads = links
    error = np.abs(of.likely(loads) - true).max(axis=0)
    alone = np.abs(of.likely(replace(loads, inertia=loads.inertia * np.eye(4))) - true).max(axis=0)
    assert np.ptp(loads.q[:, 0]) == 0.0 and np.ptp(true[:, 0]) > 1.2e-3  # it moves though its motor stands
    assert error[0] < 0.2e-3 and error[1] < 0.2e-3, error  # one sweep leaves 0.3e-3 of the outer one
    assert alone[0] > 1.2e-3, alone  # what no coupling leaves


def test_links_are_carried_one_by_one_as_all_at_once(links: tuple[np.ndarray, DriveTrains, LinkLoads]) -> None:
    _, of, loads = links
    batch, stream = of.of_loads(loads), stream_of(of)
    state, angles = stream.begin(loads.t[0], np.array([loads.q[0], loads.v[0], loads.a[0]]))
    found = [angles.q]
    for i in range(1, len(loads.t)):
        state, angles = stream.step(state, loads.t[i], np.array([loads.q[i], loads.v[i], loads.a[i]]))
        found.append(angles.q)
    assert np.abs(np.concatenate(found) - batch.q).max() < 1e-12


def test_trains_may_be_listed_in_any_order(links: tuple[np.ndarray, DriveTrains, LinkLoads]) -> None:
    _, of, loads = links
    assert np.abs(replace(of, trains=of.trains[::-1]).likely(loads) - of.likely(loads)).max() < 1e-12
