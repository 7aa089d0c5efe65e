"""What a plate says of parameters: against a Kalman filter, and on drives that rub otherwise than was fitted."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.stages.stick_slip.fit import fit_direction
from calibration.stages.stick_slip.forcing import Tilting
from calibration.stages.stick_slip.kernel.informed import informed_along
from calibration.stages.stick_slip.kernel.preloaded import LEFT, TRUST
from calibration.stages.stick_slip.model import StickSlip
from calibration.stages.stick_slip.search import warmed
from tests.calibration.stages.stick_slip import slipping
from tests.calibration.stages.stick_slip.slipping import TRUTH, WHEELS

N, DT = 16, 0.01


def test_members_are_weighed_as_a_kalman_filter_weighs_their_parameters():
    """Positions and forces linear in two parameters of which a plate shows one, and small forces: no robust weight."""
    rng, samples = np.random.default_rng(0), 200
    theta = rng.normal(size=(N, 2))
    theta -= theta.mean(axis=0)
    H = 1e-3 * np.stack([rng.normal(size=(samples, 3)), np.zeros((samples, 3))])
    to_x, r = rng.normal(size=(2, 3)), 1e-3 * rng.normal(size=(samples, 3))
    missed = r + np.einsum("ep,pta->eta", theta, H)
    x = np.broadcast_to((0.3 + theta @ to_x)[:, None], (N, samples, 3))
    P = theta.T @ theta / N
    information = np.linalg.inv(P) + 2.0 * TRUST * DT * np.einsum("pta,qta->pq", H, H)
    off = -np.linalg.solve(information, 2.0 * TRUST * DT * np.einsum("pta,ta->p", H, r))
    left = (1.0 - LEFT) * np.linalg.inv(information) + LEFT * P
    found = informed_along(missed, x, DT)[-1]
    np.testing.assert_allclose(found[0], 0.3 + off @ to_x, rtol=1e-5)
    np.testing.assert_allclose(found[1], np.einsum("pa,pq,qa->a", to_x, left, to_x), rtol=1e-5)
    assert np.abs(off[0]) > 100.0 * np.abs(off[1] - off[0] * P[1, 0] / P[0, 0])


def test_members_that_no_plate_judges_are_their_mean_and_variance():
    x = np.random.default_rng(1).normal(size=(N, 5, 3))
    found = informed_along(np.zeros((N, 5, 3)), x, DT)
    np.testing.assert_allclose(found, np.stack([x.mean(axis=0), x.var(axis=0)], axis=1), rtol=1e-12)


def test_forces_far_beyond_the_noise_count_little():
    theta = np.linspace(-1.0, 1.0, N)[:, None, None] * np.ones((N, 1, 3))
    near, far = (informed_along(theta + missing, theta, DT)[0, 0] for missing in (1.0, 100.0))
    assert np.all(np.abs(far) < 0.1 * np.abs(near)) and np.all(near < 0.0)


@pytest.fixture(scope="module")
def model():
    trials = slipping.campaign(3, seed=21)
    direction = fit_direction("plate", trials, warmed(trials, TRUTH.logarithms))
    return StickSlip(WHEELS, Tilting(1e7 * np.eye(6), np.eye(6)), (direction,))


@pytest.mark.parametrize("rubs", [0.95, 1.05, 1.1])
def test_drives_that_rub_otherwise_are_seen_once_they_slide(model, rubs):
    """They slide in jolts, hardly in calibration trials; a tenth of their friction decides how far the base turns."""
    direction, left, alone = model.directions[0], [], []
    for seed in range(42, 50):
        w = slipping.push(np.random.default_rng(seed))
        x, force = slipping.slid(w, replace(TRUTH, drive_mu=rubs * TRUTH.drive_mu))
        forcing, true = slipping.forcing(w, force), x[-1]
        every, _, _ = model._motions(forcing, direction, np.zeros((1, len(WHEELS.names), 2)))
        left.append((model.predict(forcing).x[-1] - true)[2])
        alone.append((every[: len(direction.ensemble), -1].mean(axis=0) - true)[2])
    assert np.linalg.norm(left) < 0.7 * np.linalg.norm(alone)
