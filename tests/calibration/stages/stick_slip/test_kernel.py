from dataclasses import replace

import numpy as np
import pytest

from calibration.stages.stick_slip.forcing import STEP, STEPS
from calibration.stages.stick_slip.kernel.bases import COLUMNS, FAR, LANES, LEANS, LOAD, TILTS, E, F, at_rest
from calibration.stages.stick_slip.kernel.integration import advance, simulated
from calibration.stages.stick_slip.kernel.wheel_forces import deflect_at_rest
from calibration.stages.stick_slip.likelihood import bases_of
from calibration.stages.stick_slip.wheels import LOGARITHMS
from tests.calibration.stages.stick_slip import slipping
from tests.calibration.stages.stick_slip.slipping import MASS, POSITION, TRUTH, WEIGHT, WHEELS

STUCK = replace(TRUTH, drive_mu=1e3, front_mu=1e3, back_mu=1e3)

SHARES = np.array([TRUTH.drive_load] * 2 + [1.0] * 2 + [TRUTH.back_load] * 2)


def run(one, p=TRUTH, corrected=False, start=None, wheels=WHEELS):
    bases = bases_of(wheels, p.logarithms[None], corrected, None if start is None else start[None])
    (x,), (share,), _ = simulated(np.array([0, len(one.inertia)]), one.drive, one.inertia, bases, STEP, 1)
    return x, share


@pytest.mark.parametrize(("held", "vertical"), [((0.0, 0.0), 0.0), ((1.5, -0.4), 0.0), ((0.0, 0.0), 1.4e5)])
def test_the_kernel_is_the_equations_of_its_docstring(held, vertical):
    of = replace(WHEELS, vertical=vertical)
    w, p = slipping.push(np.random.default_rng(0), seconds=3.0), replace(TRUTH, drive_held=held[0], back_held=held[1])
    tilt = 2e-3 * np.sin(np.arange(len(w)) * STEP)[:, None] * [1.0, -2.0]
    true, one = slipping.literal(w, p, tilt=tilt, of=of), slipping.forcing(w)
    one.drive[:, 6:8] = tilt
    x, share = run(one, p, wheels=of)
    np.testing.assert_allclose(x, true.x[STEPS - 1 :: STEPS], atol=2e-9)  # sine and cosine are series
    np.testing.assert_allclose(share, true.slides.reshape(-1, STEPS * 6).mean(axis=1))
    assert 0.01 < share.mean() < 0.9


def test_a_base_that_moved_on_its_plate_bears_on_other_wheels():
    w = slipping.push(np.random.default_rng(0), seconds=3.0)
    true, fixed, one = slipping.literal(w, plate=True), slipping.literal(w), slipping.forcing(w)
    wheels, bodies = WHEELS.rows(TRUTH)[None], np.array([[TRUTH.body_c, TRUTH.body_cr, 1e-12, 0.1]])
    (x,), _, _ = simulated(np.array([0, len(one.inertia)]), one.drive, one.inertia, at_rest(wheels, bodies), STEP, 1)
    own = np.abs(x - true.x[STEPS - 1 :: STEPS]).max(axis=0)
    assert np.all(own < 0.05 * np.abs(fixed.x - true.x).max(axis=0))  # to first order in the yaw


def test_loads_about_a_moved_base_are_those_of_wheels_that_moved():
    x, N = np.array([8e-3, -5e-3, 0.06]), np.array([130.0, 150.0, 170.0, 140.0, 30.0, 60.0])
    at = POSITION @ np.array([[np.cos(x[2]), np.sin(x[2])], [-np.sin(x[2]), np.cos(x[2])]]) + x[:2]
    np.testing.assert_allclose(slipping.about(x, np.array([N.sum(), *(N @ at)])), [N.sum(), *(N @ POSITION)])


def test_markers_that_are_elsewhere_on_the_base_see_the_same_wheels_slip():
    """Of a base whose middle is `off` in the frame of its markers, all wrenches about that frame's origin."""
    off, free = np.array([4e-3, -6e-3]), replace(TRUTH, body_c=1e-9)
    w = slipping.push(np.random.default_rng(3), size=1.5)
    seen = w + np.outer(w[:, 1] * off[0] - w[:, 0] * off[1], [0.0, 0.0, 1.0])
    A = np.array([[1.0, 0.0, -off[1]], [0.0, 1.0, off[0]], [0.0, 0.0, 1.0]])
    x, _ = slipping.slid(w, free)
    there, _ = slipping.slid(seen, free, of=replace(WHEELS, shift=off), mass=A.T @ MASS @ A)
    c, s = np.cos(there[:, 2]), np.sin(there[:, 2])
    middle = there[:, :2] + np.column_stack([c * off[0] - s * off[1], s * off[0] + c * off[1]]) - off
    assert np.abs(x[:, 2]).max() > 5e-3 and np.abs(x[-1, 2]) > 1e-3
    np.testing.assert_allclose(there[:, 2], x[:, 2], atol=1e-7)
    np.testing.assert_allclose(middle, x[:, :2], atol=1e-7)


def test_a_braked_wheel_rolls_as_the_base_tilts():
    """It bears its load ahead of where it stood, and its mass takes force to be rolled there."""
    (state,), (wheels,), (lanes,), _ = bases_of(WHEELS, STUCK.logarithms[None], False)
    rows, rx, ry, ax, ay = WHEELS.rows(STUCK), 2e-3, -3e-3, 1.5, -0.7
    drive, inertia = np.zeros((1, COLUMNS)), np.concatenate([1e6 * np.eye(3)[np.triu_indices(3)], np.zeros(9)])
    drive[0, 3:6], drive[0, 6:8], drive[0, TILTS:] = WEIGHT, (rx, ry), (ax, ay)
    deflect_at_rest(wheels.reshape(-1), drive[0], lanes)
    e = wheels[:, E : E + 2, 0].copy()
    advance(state, wheels, drive, inertia, STEP, lanes)
    shift = (rows[:, 6] + rows[:, 7:10] @ WEIGHT) @ (e - WHEELS.radius[:, None] * [ry, -rx])
    np.testing.assert_allclose(state[LEANS : LEANS + 2, 0], shift, rtol=1e-12)
    np.testing.assert_allclose(state[F : F + 2, 0], (WHEELS.mass @ WHEELS.radius) * np.array([-ay, ax]), atol=1e-9)


@pytest.mark.parametrize("load", [(730.0, 75.0, 20.0), (730.0, 95.0, 0.0), (730.0, -120.0, 30.0)])
def test_where_wheels_are_off_the_floor_the_others_bear_the_load(load):
    ((state,), (wheels,), (lanes,), _), rows = bases_of(WHEELS, STUCK.logarithms[None], False), WHEELS.rows(STUCK)
    drive, inertia = np.zeros((2, COLUMNS)), np.concatenate([MASS[np.triu_indices(3)], np.zeros(9)])
    drive[:, 3:6] = load
    advance(state, wheels, drive, inertia, STEP, lanes)
    N = rows[:, 6] + rows[:, 7:10] @ state[LOAD : LOAD + 3, 0]
    assert N.min() < 0.0 < N.max() and (rows[:, 6] + rows[:, 7:10] @ load).min() < -20.0
    N = np.maximum(N, 0.0)
    np.testing.assert_allclose([N.sum(), N @ POSITION[:, 0], N @ POSITION[:, 1]], load, rtol=1e-9, atol=1e-9)
    springs = np.linalg.lstsq(np.column_stack([np.ones(6), POSITION])[N > 0], (N - rows[:, 6])[N > 0] / SHARES[N > 0])
    np.testing.assert_allclose(springs[1], 0.0, atol=1e-9)  # as springs under a rigid base have it


@pytest.mark.parametrize("load", [(730.0, 20.0, 3.0), (730.0, 95.0, 0.0)])
def test_wheels_left_behind_by_a_base_that_leans_bear_as_springs_that_stand_elsewhere_under_it(load):
    of, (rx, ry) = replace(WHEELS, vertical=1.4e5, radius=np.zeros(6)), (-2e-3, 4e-3)
    e = 5e-3 * np.random.default_rng(2).normal(size=(6, 2))
    ((state,), (wheels,), (lanes,), _), rows = bases_of(of, STUCK.logarithms[None], False, e[None]), of.rows(STUCK)
    drive, inertia = np.zeros((9, COLUMNS)), np.concatenate([1e9 * np.eye(3)[np.triu_indices(3)], np.zeros(9)])
    drive[:, 3:6], drive[:, 6:8] = load, (rx, ry)
    advance(state, wheels, drive, inertia, STEP, lanes)
    N = np.maximum(rows[:, 6] + rows[:, 7:10] @ state[LOAD : LOAD + 3, 0] - rows[:, 15] * (e @ [ry, -rx]), 0.0)
    assert (N == 0.0).any() == (load[1] > 50.0)
    np.testing.assert_allclose([N.sum(), *(N @ (POSITION - e))], load, rtol=1e-5, atol=1e-3)
    springs, on = np.column_stack([np.ones(6), POSITION]), N > 0.0
    pressed = (N - rows[:, 6]) / (of.vertical * SHARES) + e @ [ry, -rx]  # by the base, where the wheel was
    np.testing.assert_allclose(np.linalg.lstsq(springs[on], pressed[on])[1], 0.0, atol=1e-15)


def test_a_wheel_bears_where_it_touches_the_floor():
    """Pushed aside by 3 N.m about the axis of the drives, wheels stay behind: so much the load of each leans on it."""
    force, p = np.array([0.0, -60.0, 0.0]), STUCK
    one = slipping.forcing(np.repeat(force[None], round(6.0 / STEP), axis=0))
    ((state,), (wheels,), (lanes,), _), rows = bases_of(WHEELS, p.logarithms[None], False), WHEELS.rows(p)
    advance(state, wheels, one.drive, one.inertia[0], STEP, lanes)
    N = rows[:, 6] + rows[:, 7:10] @ state[LOAD : LOAD + 3, 0]
    at = POSITION - wheels[:, E : E + 2, 0]
    np.testing.assert_allclose([N.sum(), *(N @ at)], WEIGHT, rtol=1e-6)
    assert abs(N @ POSITION[:, 1] - WEIGHT[2]) > 0.5


def test_wheels_that_stick_answer_a_steady_force_by_their_stiffness():
    force = 1e-3 * np.array([5.0, -8.0, 3.0])  # so little that where wheels touch the floor stays
    w = np.repeat(force[None], round(6.0 / STEP), axis=0)
    x, share = run(slipping.forcing(w), STUCK)
    np.testing.assert_allclose(x[-1], np.linalg.solve(WHEELS.stiffness(TRUTH), force), rtol=1e-6)
    assert share.max() == 0.0


def test_wheels_that_stick_sway_as_springs_and_dampers_do():
    """By X = (K + i w C - w^2 M)^-1 F at 3 Hz, in size to a two hundredth, in time to a tenth of a millisecond."""
    p, omega, force = replace(STUCK, body_c=1e-9, body_cr=1e-9), 6.0 * np.pi, 1e-3 * np.array([5.0, -8.0, 3.0])
    A, c = [slipping.across(q) for q in POSITION], WHEELS.rows(p)[:, 4]
    M = MASS - sum(m * a.T @ a for m, a in zip(WHEELS.mass, A, strict=True))
    C = sum(damping * a.T @ a for damping, a in zip(c, A, strict=True))
    swayed = np.linalg.solve(WHEELS.stiffness(p) + 1j * omega * C - omega**2 * M, force)
    t = np.arange(round(10.0 / STEP)) * STEP
    x, _ = run(slipping.forcing((np.clip(t / 4.0, 0.0, 1.0) * np.sin(omega * t))[:, None] * force), p)
    last = slice(-300, None)  # three seconds
    at = t[STEPS - 1 :: STEPS][last]
    found = np.linalg.lstsq(np.stack([np.sin(omega * at), np.cos(omega * at)], axis=1), x[last])[0]
    ratio = (found[0] + 1j * found[1]) / swayed
    np.testing.assert_allclose(np.abs(ratio), 1.0, atol=5e-3)
    np.testing.assert_allclose(np.angle(ratio) / omega, 0.0, atol=1e-4)


def test_wheels_that_slide_leave_a_constant_friction():
    p, mass = replace(TRUTH, body_c=1e-9, body_cr=1e-9), 70.0
    rows = WHEELS.rows(p)
    mu, N = rows[:, 5], rows[:, 6] + rows[:, 7:10] @ WEIGHT
    pull = 2.0 * float(mu @ N)
    for _ in range(20):  # a wheel is e behind its place: its spring pulls it against friction, and accelerates it
        e = (mu * N + WHEELS.mass * (pull - mu @ N) / mass) / rows[:, 2]
        N = rows[:, 6] + rows[:, 7:10] @ (WEIGHT + [0.0, N @ e, 0.0])
    one = slipping.forcing(np.repeat([[pull, 0.0, 0.0]], round(1.0 / STEP), axis=0))
    one.inertia[:, :6] = np.diag([mass, mass, 1e9])[np.triu_indices(3)]
    x, share = run(one, p)
    assert share[-1] == 1.0
    velocity = np.diff(x[:, 0])[-20:] * 100.0
    np.testing.assert_allclose(np.diff(velocity) * 100.0, (pull - mu @ N) / mass, rtol=1e-3)


def test_a_sprung_base_keeps_its_energy_without_dampers():
    p = replace(STUCK, drive_c=1e-9, caster_c=1e-9, body_c=1e-9, body_cr=1e-9)
    ((state,), (wheels,), (lanes,), _), rows = bases_of(WHEELS, p.logarithms[None], False), WHEELS.rows(p)
    state[3:6] = np.array([[0.05], [-0.03], [0.2]])
    A = np.array([slipping.across(q) for q in POSITION])
    M = MASS - np.einsum("i,iab,iac->bc", WHEELS.mass, A, A)  # wheels that stick do not move
    one, energy = slipping.forcing(np.zeros((1000 * STEPS, 3))), []
    for k in range(1000):
        advance(state, wheels, one.drive[STEPS * k : STEPS * (k + 1)], one.inertia[k], STEP, lanes)
        v, e = state[3:6, 0], wheels[:, E : E + 2, 0]
        e = e + 0.5 * STEP * np.array([slipping.across(q) @ v for q in POSITION - e])  # half a step on, as v is
        energy.append(0.5 * v @ M @ v + 0.5 * (rows[:, 2:4] * e**2).sum())
    np.testing.assert_allclose(energy, energy[0], rtol=0.05)
    assert abs(np.mean(energy[-100:]) / np.mean(energy[:100]) - 1.0) < 0.005


@pytest.mark.parametrize(("off", "share"), [(0.0, 1.0), (FAR, 0.5)])
def test_wheels_hold_each_other_where_trials_begin_and_half_of_it_far_from_there(off, share):
    of, load = replace(WHEELS, usual=WEIGHT[1:]), WEIGHT + np.array([0.0, 0.6 * off, -0.8 * off])
    p = replace(TRUTH, drive_held=1.5, back_held=-0.4)
    (_, (wheels,), (lanes,), _), drive = bases_of(of, p.logarithms[None], False), np.zeros(COLUMNS)
    drive[3:6] = load
    deflect_at_rest(wheels.reshape(-1), drive, lanes)
    f = wheels[:, E : E + 2, 0] * of.rows(p)[:, 2:4]
    np.testing.assert_allclose(f[:, 0], share * np.array([1.5, 1.5, -1.1, -1.1, -0.4, -0.4]))
    np.testing.assert_array_equal(f[:, 1], 0.0)
    A = np.array([slipping.across(q) for q in POSITION])
    np.testing.assert_allclose(np.einsum("iab,ia->b", A, f), 0.0, atol=1e-12)


def test_a_wheel_carried_back_and_forth_dissipates_what_jenkins_element_does():
    k, mu, N, amplitude, h = 14e3, 0.25, 190.0, 8e-3, 1e-3
    row = np.array([[[0.0, 0.0, k, k, 0.0, mu, N, *np.zeros(9)]]])
    u = amplitude * np.sin(np.linspace(0.0, 4.0 * np.pi, 40001))
    (state,), (wheels,), (lanes,), _ = at_rest(row, np.zeros((1, 4)))
    inertia, force = np.array([1.0, 0.0, 0.0, 1.0, 0.0, 1.0, *np.zeros(9)]), np.zeros(len(u))
    for n in range(1, len(u)):
        state[3], drive = (u[n] - u[n - 1]) / h, np.zeros((1, COLUMNS))
        advance(state, wheels, drive, inertia, h, lanes)
        force[n] = -state[9, 0]  # of a mass of 1 kg that nothing else accelerates
    loop = slice(20000, 40001)
    work = np.trapezoid(force[loop], u[loop])
    assert work == pytest.approx(4.0 * mu * N * (amplitude - mu * N / k), rel=1e-3)
    assert np.abs(force).max() == pytest.approx(mu * N)


def test_the_plate_corrects_what_inverse_dynamics_has_wrong():
    w = slipping.push(np.random.default_rng(3), seconds=6.0, size=0.6)
    true = slipping.literal(w)
    wrong = slipping.forcing(0.8 * w, true.force)
    alone, _ = run(wrong)
    corrected, _ = run(wrong, corrected=True)
    error = [np.abs(x - true.x[STEPS - 1 :: STEPS]).mean(axis=0) for x in (alone, corrected)]
    assert np.all(error[1] < 0.35 * error[0])


def test_the_correction_is_none_where_every_wheel_slides():
    p, light = replace(TRUTH, drive_mu=1e-6, front_mu=1e-6, back_mu=1e-6), replace(WHEELS, weight=np.zeros(6))
    plate = np.repeat([[20.0, 0.0, 0.0]], 2000, axis=0)
    pulled = np.repeat([[0.1, 0.0, 0.0]], 2000, axis=0)
    x, share = run(slipping.forcing(pulled, plate), p, corrected=True, wheels=light)
    assert share[5:].min() == 1.0
    free, _ = run(slipping.forcing(pulled), p, wheels=light)
    np.testing.assert_allclose(x[-1], free[-1], rtol=0.05)


def test_trials_one_after_the_other_do_not_know_of_each_other():
    one = slipping.forcing(slipping.push(np.random.default_rng(4), seconds=3.0))
    n = len(one.inertia)
    drive, inertia = np.concatenate([one.drive] * 2), np.concatenate([one.inertia] * 2)
    bases = bases_of(WHEELS, TRUTH.logarithms[None], False)
    (twice,), _, _ = simulated(np.array([0, n, 2 * n]), drive, inertia, bases, STEP, 1)
    np.testing.assert_array_equal(twice[:n], twice[n:])
    np.testing.assert_array_equal(twice[:n], run(one)[0])


def test_bases_side_by_side_do_not_know_of_each_other():
    """More than a group of them, each with its own parameters and preload: to the last bit as if alone.

    But for where the wheels are, which count in the robot's inertia as those of the first one.
    """
    rng = np.random.default_rng(5)
    w = slipping.push(rng, seconds=3.0)
    one, k = slipping.forcing(w, w), LANES + 3
    p, e = TRUTH.logarithms + 0.2 * rng.normal(size=(k, len(TRUTH.logarithms))), 1e-4 * rng.normal(size=(k, 6, 2))
    p[:, LOGARITHMS:], starts = TRUTH.logarithms[LOGARITHMS:], np.array([0, len(one.inertia)])
    x, share, _ = simulated(starts, one.drive, one.inertia, bases_of(WHEELS, p, True, e), STEP, k)
    for i in range(k):
        (alone,), (slid,), _ = simulated(
            starts, one.drive, one.inertia, bases_of(WHEELS, p[i : i + 1], True, e[i : i + 1]), STEP, 1
        )
        np.testing.assert_array_equal(x[i], alone)
        np.testing.assert_array_equal(share[i], slid)
    assert share.mean() > 0.005
