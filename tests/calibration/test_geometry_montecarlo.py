"""Many robots whose model the fit contains: efficiency against the Cramer-Rao bound, coverage, consistency (NEES).

Four markers with 0.2 mm of noise per axis, everything else unknown: laboratory, marker body and its shape, sizes of the
random errors, priors' widths, gears. Placements and zeros are drawn from what is believed beforehand. Judged at 200
postures the fit has not seen, where no choice of gauge matters. One robot's errors hang together over its postures:
robots, not postures, are what is counted, the standard error is that over them.
"""

import numpy as np
import pytest

import mjcf
from calibration.bodies import body_poses
from calibration.geometry_arrays import Widths, fit_chain
from calibration.parameters import DEFLECTION, gear_tolerances
from calibration.robot import chain_of_frames
from calibration.se3 import inverse
from calibration.twists import log6
from tests.calibration import matched
from tests.calibration.test_geometry_arrays import markers

SIGMA, POSTURES, NEW, SEEDS, KNOWN = 2e-4, 40, 200, 1000, 12 + 7 * 8


def judged(chain, seed, soft):
    """Of one robot, over NEW unseen hand poses: mean squared error and Cramer-Rao bound of position and rotation
    (2, 2), share of 95 % intervals that hold the truth, NEES per degree of freedom.

    `soft`: every second gear gives, by as much as is believed of one that does; the bound is that of stiff gears.
    """
    rng = np.random.default_rng([seed, 31])
    xi, zeros = rng.normal(size=(8, 6)) * np.repeat([4e-3, 8e-3], 3), rng.normal(size=8) * np.r_[4e-3, np.full(7, 4e-2)]
    reading = matched.random_angles(rng, POSTURES + NEW) + zeros
    tau = chain.gravity_torques(reading)
    gives = gear_tolerances(chain, tau[:POSTURES], DEFLECTION) * rng.normal(size=8) * (rng.random(8) < 0.5)
    truth, q = matched.Truth(xi=xi, offset=zeros), reading - zeros - soft * gives * tau
    found = fit_chain(chain, reading[:POSTURES], markers(truth, q[:POSTURES], SIGMA, seed), Widths())
    true = body_poses(found.markers, markers(truth, q[POSTURES:], 0.0)).T
    predicted = found.hand.poses_and_derivatives(reading[POSTURES:])
    J, scale = predicted.J, found.parameters.scale[:KNOWN]
    # The bound: the markers' noise alone is known, nothing is believed beforehand, no gear gives.
    noise = found.fit.noise.B[:, :, -6:]
    A = (np.linalg.inv(np.linalg.cholesky(noise @ np.swapaxes(noise, 1, 2))) @ found.fit.at.J[:, :, :KNOWN]) * scale
    A = A.reshape(-1, KNOWN)
    G = J[:, :, :KNOWN] * scale
    bound = np.diagonal(
        G @ np.linalg.pinv(A.T @ A, rcond=1e-11, hermitian=True) @ np.swapaxes(G, 1, 2), axis1=1, axis2=2
    )
    error, stated = log6(inverse(true) @ predicted.T), J @ found.fit.covariance @ np.swapaxes(J, 1, 2)
    covered = (np.abs(error) <= 1.959964 * np.sqrt(np.diagonal(stated, axis1=1, axis2=2))).mean()
    nees = np.einsum("ki,kij,kj->", error, np.linalg.inv(stated), error) / error.size
    both = [[x[:, :3].mean(), x[:, 3:].mean()] for x in (error**2, bound)]
    return np.array(both), covered, nees


@pytest.mark.slow
@pytest.mark.parametrize("soft", [False, True], ids=["stiff gears", "every second gear gives"])
def test_a_thousand_matched_robots_are_calibrated_as_well_as_noise_allows(soft):
    chain = chain_of_frames(mjcf.urdf(), matched.JOINTS, "base_footprint", "gripper_grasping_frame")
    squares, covered, nees = map(np.array, zip(*(judged(chain, seed, soft) for seed in range(SEEDS)), strict=True))
    ratio = np.sqrt(squares[:, 0].mean(axis=0) / squares[:, 1].mean(axis=0))
    print(f"RMSE of position and rotation {ratio.round(3)} x the Cramer-Rao bound of stiff gears")
    assert soft or (ratio <= 1.1).all()
    sure = nees.std(ddof=1) / np.sqrt(SEEDS)
    print(f"95 % coverage {100 * covered.mean():.1f} %, NEES {nees.mean():.3f} +- {sure:.3f} per degree of freedom")
    assert 0.93 <= covered.mean() <= 0.97
    # Never narrow; wide by 3 % of a standard deviation at most, the price of asking which gears and random errors are.
    assert 0.97**2 <= nees.mean() <= 1.0 + 1.96 * sure
