from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from calibration.stages.stick_slip.forcing import STEP, STEPS
from calibration.stages.stick_slip.kernel.bases import VECTOR
from calibration.stages.stick_slip.kernel.heaving import Springs, accelerations, damped, heaving
from calibration.stages.stick_slip.likelihood import bases_of
from tests.calibration.stages.stick_slip.slipping import MASS, POSITION, TRUTH, WEIGHT, WHEELS

STUCK = replace(TRUTH, drive_mu=1e3, front_mu=1e3, back_mu=1e3)
ON_ICE = replace(TRUTH, drive_mu=1e-9, front_mu=1e-9, back_mu=1e-9, body_c=1e-9, body_cr=1e-9)
KZ = 1.1e5 * np.array([TRUTH.drive_load] * 2 + [1.0] * 2 + [TRUTH.back_load] * 2)
A = np.column_stack([np.ones(6), POSITION[:, 1], -POSITION[:, 0]])  # z, rx, ry of the base at a wheel
K = A.T @ (KZ[:, None] * A)
HIGH = 0.45  # [m] of the centre of mass
M = np.zeros((6, 6))
M[:3, :3] = MASS
M[3:, 3:] = np.diag([74.0, 9.0 + 74.0 * HIGH**2, 11.0 + 74.0 * HIGH**2])
M[3:, :3] = [[0.0, 0.0, 0.0], [0.0, -74.0 * HIGH, 0.0], [74.0 * HIGH, 0.0, 0.0]]
M[:3, 3:] = M[3:, :3].T
TANGENT = K + np.diag([0.0, -730.0 * HIGH, -730.0 * HIGH])
BARE = replace(WHEELS, weight=np.zeros(6))  # wheels without mass
TIMES = np.arange(600) * STEP
LEVEL = np.zeros(2)


def swung(size):
    """Change of the wrench (n, 6): the arm swings, and starts with a jerk."""
    t, w = TIMES, np.zeros((len(TIMES), 6))
    swing = np.sin(4.0 * (t - 0.5)) * (t > 0.5)
    jerk = np.exp(-(((t - 0.6) / 0.08) ** 2))
    w[:, 0], w[:, 1], w[:, 2] = 10.0 * swing + 30.0 * jerk, 8.0 * swing, 5.0 * swing
    w[:, 3], w[:, 4], w[:, 5] = 6.0 * jerk, -9.0 * swing, 8.0 * swing + 25.0 * jerk
    return size * w


def found(p, w, springs, on=BARE):
    (state,), (wheels,), _, _ = bases_of(on, p.logarithms[None], False)
    n = len(w) // STEPS
    rows = np.zeros((n, 15))
    rows[:, :6] = MASS[np.triu_indices(3)]
    rows[:, 6:] = (M[3:, :3][[0, 2, 1]] * np.array([1.0, -1.0, 1.0])[:, None]).ravel()
    return heaving(state, wheels, VECTOR, w, np.repeat(M[None], n, axis=0), rows, springs, STEP)


def springs():
    rest = WEIGHT[[0, 2, 1]] * [-1.0, -1.0, 1.0]
    return Springs(K, 0.01 * K, TANGENT, rest, BARE.standing(np.array([TRUTH.drive_load, TRUTH.back_load])), LEVEL)


def solved(M, C, K, w):
    """x (n, k) of M x'' + C x' + K x = w (n, k), an independent integration."""
    k, inverse = len(M), np.linalg.inv(M)

    def rates(t, s):
        force = np.array([np.interp(t, TIMES, c) for c in w.T])
        return np.concatenate([s[k:], inverse @ (force - C @ s[k:] - K @ s[:k])])

    span = (0.0, TIMES[-1])
    return solve_ivp(rates, span, np.zeros(2 * k), t_eval=TIMES, rtol=1e-8, atol=1e-11, max_step=2e-3).y[:k].T


def test_a_base_whose_wheels_stick_is_a_linear_one_of_six_degrees_of_freedom():
    planar, dampers = WHEELS.stiffness(STUCK), np.zeros((3, 3))
    for kind, (x, y) in zip(WHEELS.types, POSITION, strict=True):
        a = np.array([[1.0, 0.0, -y], [0.0, 1.0, x]])
        dampers += (STUCK.drive_c if kind == "drive" else STUCK.caster_c) * a.T @ a
    dampers += np.diag([STUCK.body_c, STUCK.body_c, STUCK.body_cr])
    whole, damped = np.zeros((6, 6)), np.zeros((6, 6))
    whole[:3, :3], whole[3:, 3:], damped[:3, :3], damped[3:, 3:] = planar, TANGENT, dampers, 0.01 * K
    whole[:3, 3:] = [[0.0, 0.0, -WEIGHT[0]], [0.0, WEIGHT[0], 0.0], [0.0, WEIGHT[1], WEIGHT[2]]]  # bushings lean
    w = swung(0.3)
    true = solved(M, damped, whole, w)[:, 3:]
    error = np.abs(found(STUCK, w, springs()) - true).max(axis=0)
    assert np.all(error < 0.02 * np.abs(true).max(axis=0))


@pytest.mark.parametrize("axis", [1, 2])
def test_a_base_on_ice_tilts_about_its_centre_of_mass(axis):
    w = swung(0.3)
    S = M[3:, :3] @ np.linalg.inv(MASS)
    true = solved(M[3:, 3:] - S @ M[:3, 3:], 0.01 * K, TANGENT, w[:, 3:] - w[:, :3] @ S.T)
    h = found(ON_ICE, w, springs())
    assert np.abs(h - true)[:, axis].max() < 0.02 * np.abs(true[:, axis]).max()
    stuck = found(STUCK, w, springs())
    assert np.abs(stuck - true)[:, axis].max() > 0.2 * np.abs(true[:, axis]).max()


def test_wheels_that_lift_off_do_not_pull_the_base_back():
    w = swung(1.0)
    w[:, 5] -= 130.0 * np.exp(-(((TIMES - 1.5) / 0.1) ** 2))
    free = springs()
    glued = free._replace(standing=np.array([[0.0] * 6 + [1e9] + [0.0] * 3]))
    lifted, held = (np.abs(found(TRUTH, w, of)[:, 2]).max() for of in (free, glued))
    assert lifted > 1.15 * held
    calm = swung(0.3)
    np.testing.assert_allclose(found(TRUTH, calm, free), found(TRUTH, calm, glued), atol=1e-12)


def test_heave_is_damped_as_long_as_tilt_is_at_least() -> None:
    K, C = np.diag([1e6, 2e4, 1.6e4]), np.diag([60.0, 200.0, 240.0])
    np.testing.assert_allclose(np.diag(damped(K, C)), [1e4, 200.0, 240.0])
    np.testing.assert_array_equal(damped(K, C + np.diag([2e4, 0.0, 0.0])), C + np.diag([2e4, 0.0, 0.0]))


def test_a_plate_shows_slow_accelerations_by_heave_and_fast_ones_by_what_it_misses() -> None:
    """Heave is off where it is fast, by the plate's noise; inverse dynamics where they are slow, by a weight."""
    t, whole = np.arange(1500) / 100.0, np.zeros((1500, 6))
    whole[:, 2:5] = np.sin(2.0 * np.pi * np.array([2.0, 2.5, 3.0]) * t[:, None])
    whole[:, 2:5] += 0.5 * np.sin(2.0 * np.pi * np.array([12.0, 14.0, 16.0]) * t[:, None])
    own = np.zeros((6, 6))
    own[np.ix_((0, 1, 5, 2, 3, 4), (0, 1, 5, 2, 3, 4))] = M
    noise = np.sin(2.0 * np.pi * 15.0 * t)[:, None] * [1.0, -1.0, 1.0]
    left = whole @ own + np.array([3.0, -2.0, 9.0, 4.0, -5.0, 1.0]) * np.sin(2.0 * np.pi * 0.3 * t)[:, None]
    rows = slice(200, -200)
    found = accelerations(t, whole[:, 2:5] + noise, left, np.repeat(own[None], len(t), axis=0))
    by_balance = np.linalg.solve(own, left[:, :, None])[:, 2:5, 0]
    error, balance = (np.std((x - whole[:, 2:5])[rows], axis=0) for x in (found, by_balance))
    assert (error < 0.1 * noise[rows].std(axis=0)).all()
    assert (error[1:] < 0.1 * balance[1:]).all()
