from dataclasses import replace

import numpy as np
import pytest

from calibration.stages.stick_slip.forcing import STEP, STEPS
from calibration.stages.stick_slip.kernel import STATE, advance, simulated, wheel_force
from calibration.stages.stick_slip.likelihood import body
from tests.calibration.stages.stick_slip import slipping
from tests.calibration.stages.stick_slip.slipping import MASS, TRUTH, WEIGHT, WHEELS

STUCK = replace(TRUTH, drive_mu=1e3, front_mu=1e3, back_mu=1e3)


def run(one, p=TRUTH, corrected=False, start=None):
    settings = body(p, corrected)
    e = np.zeros((6, 2)) if start is None else start
    starts = np.array([0, len(one.inertia)])
    return simulated(starts, one.drive, one.inertia, WHEELS.rows(p), settings, STEP, e)


def test_the_kernel_is_the_equations_of_its_docstring():
    w = slipping.push(np.random.default_rng(0), seconds=3.0)
    tilt = 2e-3 * np.sin(np.arange(len(w)) * STEP)[:, None] * [1.0, -2.0]
    true, one = slipping.literal(w, tilt=tilt), slipping.forcing(w)
    one.drive[:, 6:8] = tilt
    x, share = run(one)
    np.testing.assert_allclose(x, true.x[STEPS - 1 :: STEPS], atol=1e-12)
    np.testing.assert_allclose(share, true.slides.reshape(-1, STEPS * 6).mean(axis=1))
    assert 0.01 < share.mean() < 0.9


def test_wheels_that_stick_answer_a_steady_force_by_their_stiffness():
    force = np.array([5.0, -8.0, 3.0])
    w = np.repeat(force[None], round(6.0 / STEP), axis=0)
    x, share = run(slipping.forcing(w), STUCK)
    np.testing.assert_allclose(x[-1], np.linalg.solve(WHEELS.stiffness(TRUTH), force), rtol=1e-6)
    assert share.max() == 0.0


def test_wheels_that_slide_leave_a_constant_friction():
    p = replace(TRUTH, body_c=1e-9, body_cr=1e-9)
    rows = WHEELS.rows(p)
    friction = float(rows[:, 5] @ (rows[:, 6] + rows[:, 7:] @ WEIGHT))
    one = slipping.forcing(np.repeat([[2.0 * friction, 0.0, 0.0]], round(1.0 / STEP), axis=0))
    one.inertia[:, :6] = np.diag([70.0, 70.0, 1e9])[np.triu_indices(3)]
    x, share = run(one, p)
    assert share[-1] == 1.0
    velocity = np.diff(x[:, 0])[-20:] * 100.0
    np.testing.assert_allclose(np.diff(velocity) * 100.0, friction / 70.0, rtol=1e-3)


def test_a_sprung_base_keeps_its_energy_without_dampers():
    p = replace(STUCK, drive_c=1e-9, caster_c=1e-9, body_c=1e-9, body_cr=1e-9)
    state, e, rows, K = np.zeros(STATE), np.zeros((6, 2)), WHEELS.rows(p), WHEELS.stiffness(p)
    state[3:6] = 0.05, -0.03, 0.2
    one, energy = slipping.forcing(np.zeros((2000, 3))), []
    for k in range(1000):
        advance(state, e, one.drive[2 * k : 2 * k + 2], one.inertia[k], rows, body(p, False), STEP)
        x, v = state[:3] + 0.5 * STEP * state[3:6], state[3:6]  # half a step on, where both are of one time
        energy.append(0.5 * v @ MASS @ v + 0.5 * x @ K @ x)
    np.testing.assert_allclose(energy, energy[0], rtol=0.05)
    assert abs(np.mean(energy[-100:]) / np.mean(energy[:100]) - 1.0) < 0.005


def test_a_wheel_carried_back_and_forth_dissipates_what_jenkins_element_does():
    k, mu, N, amplitude, h = 14e3, 0.25, 190.0, 8e-3, 1e-3
    row = np.array([[0.0, 0.0, k, k, 0.0, mu, N, 0.0, 0.0, 0.0]])
    u = amplitude * np.sin(np.linspace(0.0, 4.0 * np.pi, 40001))
    e, state, drive, force = np.zeros((1, 2)), np.zeros(STATE), np.zeros(11), np.zeros(len(u))
    for n in range(1, len(u)):
        d = np.array([u[n] - u[n - 1], 0.0, 0.0, 0.0, 0.0, 0.0])
        force[n], _, _ = wheel_force(row, 0, e, d, state, drive, h)
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
    p = replace(TRUTH, drive_mu=1e-6, front_mu=1e-6, back_mu=1e-6)
    plate = np.repeat([[20.0, 0.0, 0.0]], 2000, axis=0)
    x, share = run(slipping.forcing(np.repeat([[0.1, 0.0, 0.0]], 2000, axis=0), plate), p, corrected=True)
    assert share[5:].min() == 1.0
    free, _ = run(slipping.forcing(np.repeat([[0.1, 0.0, 0.0]], 2000, axis=0)), p)
    np.testing.assert_allclose(x[-1], free[-1], rtol=0.05)


def test_trials_one_after_the_other_do_not_know_of_each_other():
    one = slipping.forcing(slipping.push(np.random.default_rng(4), seconds=3.0))
    n = len(one.inertia)
    twice = simulated(
        np.array([0, n, 2 * n]),
        np.concatenate([one.drive] * 2),
        np.concatenate([one.inertia] * 2),
        WHEELS.rows(TRUTH),
        body(TRUTH, False),
        STEP,
        np.zeros((6, 2)),
    )[0]
    np.testing.assert_array_equal(twice[:n], twice[n:])
    np.testing.assert_array_equal(twice[:n], run(one)[0])
