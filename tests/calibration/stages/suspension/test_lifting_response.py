import numpy as np
from scipy.integrate import solve_ivp

from calibration.stages.suspension.base_response import Forcing
from calibration.stages.suspension.lifting_response import predicted_lifting
from calibration.stages.suspension.modal_response import predicted
from tests.calibration.stages.stick_slip.slipping import POSITION, WHEELS

SHARES = np.array([1.3, 0.8])
SPRINGS = 1.1e5 * np.array([1.3, 1.3, 1.0, 1.0, 0.8, 0.8])  # [N/m] of the wheels
DAMPERS = 0.02 * SPRINGS
M = np.diag([73.0, 73.0, 73.0, 9.0, 11.0, 3.0])
REST = np.array([0.0, 0.0, -730.0, -3.0, 30.0, 0.0])
AXES = np.column_stack([np.zeros((6, 2)), np.ones(6), POSITION[:, 1], -POSITION[:, 0], np.zeros(6)])
T = np.arange(400) * 0.01


def tipping(peak):
    """A forcing that tips the base forward for a quarter of a second, peak [N.m]."""
    w = np.zeros((len(T), 6))
    w[:, 4] = peak * np.exp(-(((T - 1.0) / 0.1) ** 2))
    return Forcing(T, w, REST, M, np.zeros((6, 6)), np.eye(4))


def springs():
    K, C = (AXES.T @ (of[:, None] * AXES) for of in (SPRINGS, DAMPERS))
    plane = np.diag([1e5, 1e5, 0.0, 0.0, 0.0, 1e4])
    return K + plane, C + 0.02 * plane


def integrated(forcing, pulls):
    """Wheel by wheel: each spring and damper pushes, or pulls where it may."""
    n, G = WHEELS.loads(*SHARES)
    at_rest = n + G @ (REST[[2, 4, 3]] * [-1.0, 1.0, -1.0])

    def rates(t, state):
        x, v = state[:6], state[6:]
        load = at_rest - AXES @ x * SPRINGS - AXES @ v * DAMPERS
        change = (load if pulls else np.maximum(load, 0.0)) - at_rest
        w = np.array([np.interp(t, T, c) for c in forcing.w.T])
        plane = [0, 1, 5]
        f = w + AXES.T @ change
        K, C = springs()
        f[plane] -= K[plane, plane] * x[plane] + C[plane, plane] * v[plane]
        return np.concatenate([v, np.linalg.solve(M, f)])

    return solve_ivp(rates, (0.0, T[-1]), np.zeros(12), t_eval=T, rtol=1e-8, atol=1e-10, max_step=2e-3).y[:6].T


def test_wheels_that_lift_off_do_not_pull_the_base_back():
    forcing, (K, C) = tipping(-160.0), springs()
    found, true = predicted_lifting(K, C, forcing, WHEELS.standing(SHARES)), integrated(forcing, False)
    assert np.abs(found - true)[:, 4].max() < 0.03 * np.abs(true[:, 4]).max()
    linear = predicted(K, C, forcing)
    np.testing.assert_allclose(integrated(forcing, True)[:, 4], linear[:, 4], atol=0.01 * np.abs(linear[:, 4]).max())
    assert np.abs(linear - true)[:, 4].max() > 0.2 * np.abs(true[:, 4]).max()


def test_a_base_that_keeps_its_wheels_on_the_floor_is_linear():
    forcing, (K, C) = tipping(-40.0), springs()
    np.testing.assert_array_equal(predicted_lifting(K, C, forcing, WHEELS.standing(SHARES)), predicted(K, C, forcing))
