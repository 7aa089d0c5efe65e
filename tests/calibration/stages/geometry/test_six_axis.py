"""Arms of six axes seen as 6D poses, many of them: what is delivered against registration, and its intervals."""

import numpy as np
import pytest

from calibration.inference.parameters import scaled
from calibration.mocap.postures import Postures
from calibration.numerics.lie import exp6, from_vector, inverse, log6, to_vector
from calibration.recording.schema import Description
from calibration.stages.geometry.cross_validation import left_out_errors
from calibration.stages.geometry.gear_deflection import calibrate_gears
from calibration.stages.geometry.model_of_fit import hand_of
from tests.doubles.six_axis_arm import JOINTS, chain, measured

SIGMA_P, SIGMA_R, NEW = 2e-4, 1e-3, 100
CHAIN = chain()
ROBOTS = 100
TOLERANCES = {
    "joint_translation": 1e-3, "joint_rotation": 2e-3, "encoder_offset": 1e-2, "joint_play": 8e-3,
    "body_translation": 0.5, "body_rotation": 1.0, "link_mass": 0.1, "link_com": 0.01,
}  # fmt: skip


def described(tolerances):
    """Frames near their places, as `fitted: true` leaves them."""
    X = [0.5, -0.3, 0.1, 0.02, -0.03, 0.7]
    Y = [0.0, 0.01, 0.05, 0.1, 0.0, -0.2]
    return Description.model_validate({
        "schema": 1, "robot": "arm", "base_frame": "pedestal", "tool_frame": "tool0",
        "joints": [{"name": j, "encoders": ["motor"], "rate": 100.0} for j in JOINTS],
        "bodies": [
            {"name": "base", "link": "pedestal", "markers": [], "placement": list(inverse_vector(X))},
            {"name": "hand", "link": "tool0", "markers": corners(), "placement": Y},
        ],
        "marker_frame": "base",
        "sigmas": {"marker": 2e-4, "encoder": 2e-5, "plate_force": 1.0, "plate_moment": 0.3},
        "tolerances": tolerances, "trials": [],
    })  # fmt: skip


def corners():
    places = ([0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1], [-0.1, 0, 0])
    return [{"name": f"hand{k}", "xyz": x} for k, x in enumerate(places)]


def inverse_vector(vector):
    return map(float, to_vector(inverse(from_vector(np.array(vector)))))


def robot(seed, n):
    """n measured postures of an arm, and readings and true poses of NEW others."""
    found, rng = measured(seed, n + NEW), np.random.default_rng([seed, n])
    S = np.diag([SIGMA_P**2] * 3 + [SIGMA_R**2] * 3)
    T = found.T[:n] @ exp6(rng.normal(size=(n, 6)) * np.sqrt(np.diag(S)))
    return Postures(found.q[:n], T, np.tile(S, (n, 1, 1)), np.zeros(n)), found.q[n:], found.T[n:]


def judged(seed, n, description):
    """Cross-validated errors of registration and full [m], share of components of new poses in their 95 % interval."""
    postures, q, true = robot(seed, n)
    rows = {f.model: f for f in left_out_errors(CHAIN, description, postures, ("registration", "full"))}
    model = scaled(calibrate_gears(CHAIN, description, postures)[0], rows["full"].excess)
    names = [p.name for p in model.parameters]
    found = hand_of(model, CHAIN, np.zeros(12)).poses_and_derivatives(q, names=names)
    error = log6(inverse(true) @ found.T)
    variance = np.einsum("nij,jk,nik->ni", found.J, model.covariance, found.J)
    variance += ((found.J_joint * model.reading_sigma) ** 2).sum(axis=2) + np.repeat(model.hand_error**2, 3)
    return rows["registration"].rmse, rows["full"].rmse, (np.abs(error) <= 1.959964 * np.sqrt(variance)).mean()


@pytest.mark.slow
@pytest.mark.parametrize("n", [25, 50])
def test_a_hundred_arms_are_better_than_registration_with_intervals_that_hold(n, claim):
    description = described(TOLERANCES)
    registration, full, covered = np.array([judged(seed, n, description) for seed in range(ROBOTS)]).T
    better = (full <= registration).mean()
    claim(f"geometry/six/{n} postures, full no worse than registration", better)
    claim(f"geometry/six/{n} postures, new poses in their 95 % intervals", covered.mean())
    assert better >= 0.95
    assert 0.93 <= covered.mean() <= 0.97
