"""Many robots whose model the fit contains: efficiency against the Cramer-Rao bound, coverage, consistency (NEES).

Four markers with 0.2 mm of noise per axis, everything else unknown: laboratory, marker body and its shape, sizes of the
random errors, priors' widths, gears. Placements and zeros are drawn from what is believed beforehand. Judged at
postures the fit has not seen, where no choice of gauge matters.
"""

import numpy as np
import pytest
from scipy.stats import chi2

import mjcf
from calibration.bodies import body_poses
from calibration.geometry_arrays import Widths, fit_chain
from calibration.robot import chain_of_frames
from calibration.se3 import inverse
from calibration.twists import log6
from tests.calibration import matched
from tests.calibration.test_geometry_arrays import markers

SIGMA, POSTURES, NEW, SEEDS, KNOWN = 2e-4, 40, 4, 1000, 12 + 7 * 8


def judged(chain, seed):
    """Errors of unseen hand poses (NEW, 6) [m, rad], their covariance, and the Cramer-Rao bound, (NEW, 6, 6)."""
    rng = np.random.default_rng([seed, 7])
    xi, zeros = rng.normal(size=(8, 6)) * np.repeat([4e-3, 8e-3], 3), rng.normal(size=8) * np.r_[4e-3, np.full(7, 4e-2)]
    truth = matched.Truth(xi=xi, offset=zeros)
    q = matched.random_angles(rng, POSTURES + NEW)
    found = fit_chain(chain, q[:POSTURES] + truth.offset, markers(truth, q, SIGMA, seed)[:POSTURES], Widths())
    true = body_poses(found.markers, markers(truth, q[POSTURES:], 0.0)).T
    predicted = found.hand.poses_and_derivatives(q[POSTURES:] + truth.offset)
    J, scale = predicted.J, found.parameters.scale[:KNOWN]
    # The bound: the markers' noise alone is known, nothing is believed beforehand, no gear gives.
    noise = found.fit.noise.B[:, :, -6:]
    A = (np.linalg.inv(np.linalg.cholesky(noise @ np.swapaxes(noise, 1, 2))) @ found.fit.at.J[:, :, :KNOWN]) * scale
    A = A.reshape(-1, KNOWN)
    G = J[:, :, :KNOWN] * scale
    bound = G @ np.linalg.pinv(A.T @ A, rcond=1e-11, hermitian=True) @ np.swapaxes(G, 1, 2)
    return log6(inverse(true) @ predicted.T), J @ found.fit.covariance @ np.swapaxes(J, 1, 2), bound


@pytest.mark.slow
def test_a_thousand_matched_robots_are_calibrated_as_well_as_noise_allows():
    chain = chain_of_frames(mjcf.urdf(), matched.JOINTS, "base_footprint", "gripper_grasping_frame")
    error, stated, bound = map(np.array, zip(*(judged(chain, seed) for seed in range(SEEDS)), strict=True))
    least = np.diagonal(bound, axis1=2, axis2=3)
    for name, part in (("position", slice(0, 3)), ("rotation", slice(3, 6))):
        ratio = np.sqrt((error[..., part] ** 2).mean() / least[..., part].mean())
        print(f"{name}: RMSE {ratio:.3f} x the Cramer-Rao bound")
        assert ratio <= 1.1
    covered = (np.abs(error) <= 1.959964 * np.sqrt(np.diagonal(stated, axis1=2, axis2=3))).mean()
    nees = np.einsum("nki,nkij,nkj->nk", error, np.linalg.inv(stated), error).mean(axis=0) / 6
    # The postures of one robot have errors in common: the band is that of one of them.
    low, high = chi2.ppf([0.025, 0.975], 6 * SEEDS) / (6 * SEEDS)
    print(f"95 % coverage {100 * covered:.1f} %, NEES {nees.round(3)} per degree of freedom, {low:.3f}-{high:.3f}")
    assert 0.93 <= covered <= 0.97
    assert low <= nees.mean() <= high
