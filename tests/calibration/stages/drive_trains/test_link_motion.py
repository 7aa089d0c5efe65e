"""The play operator and the link behind a dead zone, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.stages.drive_trains.drive_train import DriveMotion, DriveTrain
from calibration.stages.drive_trains.kernel.link_motion import RELAXATION, contact, deflection, mesh, stepped

T = np.arange(0.0, 8.0, 0.01)


def motion(q: np.ndarray, torque: np.ndarray | float = 0.0, inertia: float = 0.05) -> DriveMotion:
    v = np.gradient(q, T)
    a = np.gradient(v, T)
    load = np.broadcast_to(torque, q.shape) + inertia * a
    return DriveMotion(T, q, v, a, np.array(load), np.full(len(q), inertia), np.array([0, len(q)]))


def train(
    gap: float, compliance: float = 1e-3, coulomb: float = 0.2, dynamic: bool = False, **more: float
) -> DriveTrain:
    values = np.array(
        [
            0.5 * gap,
            compliance,
            coulomb,
            more.get("viscous", 0.0),
            1.5e-3,
            more.get("spring", 0.0),
            more.get("slip", 0.0),
        ]
    )
    return DriveTrain("joint", "friction_held" if more.get("slip") else "dead_zone", values, dynamic=dynamic)


def test_without_load_delta_is_a_play_operator() -> None:
    q = 0.5 * np.sin(T)
    drive = motion(q, inertia=0.0)
    delta = train(0.02, 1e-3, 0.2).deltas(drive, drive.torque, np.zeros(1))
    expected, at = np.empty(len(q)), 0.0
    for i in range(len(q)):
        at = np.clip(at + (q[i] - q[i - 1] if i else 0.0), -0.01 - 2e-4, 0.01 + 2e-4)
        expected[i] = at
    assert np.abs(delta - expected).max() < 1e-15


@pytest.mark.parametrize("dynamic", [False, True])
def test_a_loaded_mesh_is_wound_up_by_its_compliance(dynamic: bool) -> None:
    drive = motion(np.zeros(len(T)), 3.0)
    delta = train(0.02, 1e-3, 0.0, dynamic).deltas(drive, drive.torque, np.array([0.01]))
    assert delta[-1] == pytest.approx(0.01 + 3e-3, rel=1e-6)


def test_friction_widens_the_hysteresis_of_a_loaded_mesh_by_twice_its_windup() -> None:
    q = 0.5 * np.sin(2.0 * T)
    drive = motion(q, 3.0, 0.0)
    delta = train(0.0, 1e-3, 0.4).deltas(drive, drive.torque, np.array([3e-3]))[200:]
    assert np.ptp(delta) == pytest.approx(2.0 * 0.4e-3, rel=1e-9)


def test_the_link_at_rest_stays_where_friction_holds_it() -> None:
    drive = motion(np.zeros(len(T)), 0.1)
    for dynamic in (False, True):
        delta = train(0.02, 1e-3, 0.2, dynamic).deltas(drive, drive.torque, np.array([0.004]))
        assert np.abs(delta - 0.004).max() < 1e-15


def test_a_light_link_follows_the_play_operator() -> None:
    q = 0.5 * np.sin(T)
    drive = motion(q, 1.5 * np.cos(0.7 * T), 1e-4)
    still, moving = (train(0.01, 1e-3, 0.2, dynamic) for dynamic in (False, True))
    a, b = (x.deltas(drive, drive.torque, np.array([6.3e-3])) for x in (still, moving))
    assert np.sqrt(((a - b) ** 2).mean()) < 2e-4


def test_a_free_link_falls_through_its_gap() -> None:
    """Without friction, 0.05 N.m on 0.05 kg.m2 for t: delta grows by t^2 / 2 until the mesh stops it."""
    drive = motion(np.zeros(len(T)), 0.05)
    delta = train(2.0, 1e-3, 0.0, True).deltas(drive, drive.torque, np.zeros(1))
    assert delta[100] == pytest.approx(0.5, rel=0.01)


@pytest.mark.parametrize("relaxation", [1e-6, 5e-3, 12e-3])
def test_a_flank_pushes_a_link_and_does_not_pull_it_back(relaxation: float) -> None:
    """Let go, wound up by w: a damped oscillation until spring and damper balance, as fast as it gets, and free then.

    w omega exp(-zeta / sqrt(1 - zeta^2) arccos zeta),     zeta = T omega / 2,     omega = 1 / sqrt(c I)
    """
    drive, of, wound = motion(np.zeros(len(T)), 0.0, inertia=0.1), train(2.0, 1e-3, 0.0, True), 1e-3
    drive = replace(drive, t=5e-3 * T)  # 50 us
    of = replace(of, values=np.where(np.arange(7) == RELAXATION, relaxation, of.values))
    delta = of.deltas(drive, drive.torque, np.array([1.0 + wound]))
    zeta = 0.5 * relaxation * 100.0
    speed = wound * 100.0 * np.exp(-zeta / np.sqrt(1.0 - zeta**2) * np.arccos(zeta))
    assert (delta[-100] - delta[-1]) / (drive.t[-1] - drive.t[-100]) == pytest.approx(speed, rel=5e-3)


def test_the_longest_step_hardly_matters() -> None:
    drive = motion(0.5 * np.sin(T), 1.5 * np.cos(0.7 * T), 0.05)
    of = train(0.01, 1e-3, 0.2, True)
    fine, coarse = (of.deltas(drive, drive.torque, np.array([6.3e-3]), h) for h in (2.5e-4, 3.4e-3))
    assert np.sqrt(((fine - coarse) ** 2).mean()) < 4e-4
    assert np.median(np.abs(fine - coarse)) < 1e-5


@pytest.mark.parametrize(("slip", "loop"), [(0.2, 2.0 * 0.3 / 2000.0), (0.1, 2.0 * (0.3 - 0.1) * 1e-3)])
def test_friction_in_the_mesh_winds_up_after_a_reversal(slip: float, loop: float) -> None:
    """An unloaded mesh without a gap: 1/c and k in parallel until the slider slips at t, 1/c beyond."""
    drive = motion(0.02 * np.sin(T), 0.0, 0.0)
    of = train(0.0, 1e-3, 0.3, True, spring=1000.0, slip=slip)
    delta = of.deltas(drive, drive.torque, np.zeros(1))[300:]
    assert np.ptp(delta) == pytest.approx(loop, rel=0.05)


def test_no_gap_is_no_jump() -> None:
    assert deflection(1e-9, 0.0, 1e-3) == pytest.approx(0.0, abs=1e-11)
    assert deflection(2.0, 0.01, 1e-3) == -deflection(-2.0, 0.01, 1e-3) == pytest.approx(0.012)


def test_several_trials_are_as_each_alone() -> None:
    one, other = motion(0.5 * np.sin(T), 1.0), motion(0.3 * np.cos(T), -0.5)
    both = DriveMotion(
        *(np.concatenate([getattr(one, n), getattr(other, n)]) for n in ("t", "q", "v", "a", "torque", "inertia")),
        np.array([0, len(T), 2 * len(T)]),
    )
    of, starts = train(0.01, dynamic=True), np.array([6e-3, -5.5e-3])
    found = of.deltas(both, both.torque, starts)
    alone = [of.deltas(d, d.torque, s) for d, s in ((one, starts[:1]), (other, starts[1:]))]
    assert (found == np.concatenate(alone)).all()


def test_a_link_is_expected_where_a_load_that_wandered_left_it() -> None:
    """Under random loads the play operator is where `begun` expects it, on average over what they did before."""
    n = 500_000
    walk = np.cumsum(0.02 * np.random.default_rng(1).normal(size=n))
    load = np.arcsin(np.sin(np.pi * walk)) / np.pi  # between walls far beyond the friction
    own, still = train(0.02, 1e-3, 0.2), np.zeros(n)
    drive = DriveMotion(0.01 * np.arange(n), still, still, still, load, still, np.array([0, n]))
    delta = own.deltas(drive, load, np.zeros(1))
    for low in np.arange(-0.3, 0.3, 0.05):
        there = (load > low) & (load < low + 0.05)
        assert abs((delta - own.begun(load))[there].mean()) < 1e-3  # a tenth of half the gap
    assert abs(delta[(load > 0.15) & (load < 0.2)].mean()) > 6e-3


@pytest.mark.parametrize("torque", [-3.0, 0.0, 3.0])
def test_trials_that_began_so_before_tell_where_a_link_begins(torque: float) -> None:
    own = replace(train(0.02, 1e-3, 0.2), start=(0.3, 0.1))
    low, high = own.ends(np.array([torque]))
    np.testing.assert_allclose(own.begun(np.array([torque])), low + 0.3 * (high - low))


def test_without_friction_the_load_alone_decides_where_a_link_begins() -> None:
    np.testing.assert_allclose(train(0.02, 1e-3, 0.0).begun(np.array([-3.0, 3.0])), [-0.013, 0.013])


@pytest.mark.parametrize("relaxation", [2e-3, 12e-3])
def test_a_step_ends_where_forces_balance(relaxation: float) -> None:
    """Near either flank, as it is struck and left: by halves of an interval, where Newton's steps may go in circles."""
    rng, h = np.random.default_rng(0), 3.3e-3
    for _ in range(500):
        c = contact(np.array([5e-3, 10.0 ** rng.uniform(-4.0, -2.7), 0.2, 0.05, relaxation, 0.0, 0.0]))
        x, rate = rng.choice([-1, 1]) * (5e-3 + 3e-4 * rng.normal()), 0.1 * rng.normal()
        dq, torque, inertia = 1e-3 * rng.normal(), 2.0 * rng.normal(), 10.0 ** rng.uniform(-3.0, 0.3)
        found, v = stepped(x, rate, 0.0, dq, torque, inertia, h, c)[0], dq / h
        load = torque - inertia / h * (v - rate)
        pull = mesh(x + dq, v, 0.0, h, c)[0] - load
        sign, low, high = np.sign(pull), -1e4, 1e4
        for _ in range(80):
            u = 0.5 * (low + high)
            left = mesh(x + dq - h * u, v - u, 0.0, h, c)[0] - load - sign * c.coulomb - (inertia / h + c.viscous) * u
            low, high = (u, high) if left > 0.0 else (low, u)
        assert found == pytest.approx(x + dq - h * (high if abs(pull) > c.coulomb else 0.0), abs=1e-9)
