import numpy as np

from calibration.numerics.signals import play
from calibration.stages.hysteretic_base.yaw import maxwell_slip

K, D, SPRING, DAMPER, STEP = np.array([900.0, 1700.0]), np.array([12e-3, 1.5e-3]), 350.0, 20.0, 0.01


def forcing(n=800):
    t = STEP * np.arange(n)
    return 18.0 * np.sin(2.0 * np.pi * 0.5 * t) * np.exp(-0.1 * t) + 3.0 * np.sin(9.0 * t)


def test_maxwell_slip_balances_its_forces_at_every_step():
    u = forcing()
    psi = maxwell_slip(u, K, D, SPRING, DAMPER, STEP)
    s, before = np.zeros(2), 0.0
    slid = 0
    for force, x in zip(u, psi, strict=True):
        elements = np.clip(K * (x - s), -K * D, K * D)
        np.testing.assert_allclose(DAMPER * (x - before) / STEP + SPRING * x + elements.sum(), force, atol=1e-8)
        slid += int((np.abs(x - s) > D).sum())
        s, before = np.clip(s, x - D, x + D), x
    assert slid > 50


def test_without_slip_it_is_a_spring():
    u = 0.1 * forcing()
    np.testing.assert_allclose(
        maxwell_slip(u, K, np.full(2, 1.0), SPRING, 1e-6, STEP), u / (SPRING + K.sum()), atol=1e-9
    )


def test_play_follows_at_its_width():
    u = np.array([0.0, 0.5, 3.0, 2.5, -2.0, -1.5])
    np.testing.assert_allclose(play(u[:, None], np.array([1.0]))[:, 0], [0.0, 0.0, 2.0, 2.0, -1.0, -1.0])
