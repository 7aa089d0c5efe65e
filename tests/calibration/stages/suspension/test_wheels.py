import numpy as np
import pytest

from calibration.stages.suspension.wheels import wheel_model
from tests.doubles.moving_base import WHEELS, values


def test_the_printed_formula_is_what_the_matrix_computes():
    rng = np.random.default_rng(0)
    p, x, rate = values(rng), 1e-3 * rng.normal(size=6), 1e-2 * rng.normal(size=6)
    t, theta, t_dot, theta_dot = x[:3], x[3:], rate[:3], rate[3:]
    F, M = np.zeros(3), np.zeros(3)
    for i, wheel in enumerate(WHEELS):
        k, c = p[6 * i : 6 * i + 6], p[36 + 6 * i : 42 + 6 * i]
        Kt, Kth, Ct, Cth = np.diag(k[:3]), np.diag(k[3:]), np.diag(c[:3]), np.diag(c[3:])
        r = np.array(wheel.centre)
        dr, dr_dot = t + np.cross(theta, r), t_dot + np.cross(theta_dot, r)
        F_i = Kt @ dr + Ct @ dr_dot
        M_i = Kth @ theta + Cth @ theta_dot + np.cross(r, F_i)
        F, M = F + F_i, M + M_i
    wheels = wheel_model(WHEELS, "centre")
    w = wheels.matrix(p[:36]) @ x + wheels.matrix(p[36:]) @ rate
    np.testing.assert_allclose(w, np.concatenate([F, M]), rtol=1e-12)


def test_a_robot_that_presses_down_harder_sinks():
    K = wheel_model(WHEELS, "contact").matrix(values(np.random.default_rng(1))[:36])
    assert np.linalg.solve(K, np.array([0.0, 0.0, -50.0, 0.0, 0.0, 0.0]))[2] < 0.0
    assert np.linalg.eigvalsh(K).min() > 0.0


def test_full_matrices_of_each_wheel_enter_symmetric():
    rng = np.random.default_rng(2)
    wheels = wheel_model(WHEELS[:1], "centre", full=True)
    p, x = rng.normal(size=12), rng.normal(size=6)
    xx, xy, xz, yy, yz, zz = p[:6]
    a, b, c, d, e, f = p[6:]
    r = np.array(WHEELS[0].centre)
    F = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ (x[:3] + np.cross(x[3:], r))
    M = np.array([[a, b, c], [b, d, e], [c, e, f]]) @ x[3:] + np.cross(r, F)
    np.testing.assert_allclose(wheels.matrix(p) @ x, np.concatenate([F, M]), rtol=1e-12)
    assert wheels.names[1] == "suspension.wheel_right.kxy"


@pytest.mark.parametrize(("point", "rank"), [("centre", 14), ("contact", 11)])
def test_one_wrench_tells_fewer_combinations_than_wheels_have_springs(point, rank):
    rng = np.random.default_rng(3)
    wheels = wheel_model(WHEELS, point)
    x, rate = rng.normal(size=(2, 500, 6))
    springs = wheels.regressor(x).reshape(-1, 36)
    both = np.concatenate([wheels.regressor(x), wheels.regressor(rate)], axis=2).reshape(-1, 72)
    assert np.linalg.matrix_rank(springs, rtol=1e-9) == rank
    assert np.linalg.matrix_rank(both, rtol=1e-9) == 2 * rank
    known = wheels.structure
    assert known.rank == rank and known.clear
    assert "estimated" not in {s for n, s in zip(wheels.names, known.status, strict=True) if n.endswith("kz")}


def test_contacts_in_the_floor_keep_sinking_and_tilting_apart_from_sliding_and_turning():
    apart = wheel_model(WHEELS, "contact").couples
    groups = {frozenset(np.flatnonzero(row).tolist()) for row in apart}
    assert groups == {frozenset({0, 1, 5}), frozenset({2, 3, 4})}
    assert wheel_model(WHEELS, "centre").couples.all()
