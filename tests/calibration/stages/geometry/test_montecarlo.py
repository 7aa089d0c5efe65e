"""Many robots whose model the fit contains: efficiency against the Cramer-Rao bound, coverage, consistency (NEES).

Four markers with 0.2 mm of noise per axis, everything else unknown: laboratory, marker body and its shape, sizes of the
random errors, priors' widths, gears. The truth is drawn from what is believed beforehand: placements and zeros from
their widths, readings and hand with the least random errors that are believed, gears either all stiff or a share of
them soft, any share as likely as any other. Judged at 200 postures the fit has not seen, where no gauge matters.

    NEES = mean_k e_k' S_k^-1 e_k / 6,     S_k = J_k C J_k',     e_k a robot's errors, C the covariance stated of it

One robot's errors hang together over its postures. Were C exact, NEES would be a sum of squared standard normals
weighted by the eigenvalues of M = sum_k L' J_k' S_k^-1 J_k L / (6 n), C = L L', whose trace is 1: its variance is
2 |M|_F^2, and the mean over robots chi-squared over its degrees of freedom nu = 2 / variance of that mean.
The band is that of 99 %, and knows nothing of the errors.
"""

import numpy as np
import pytest
from scipy.stats import chi2

import mjcf
from calibration.mocap.cluster_pose import body_poses
from calibration.numerics.lie import exp6, inverse, log6
from calibration.robot.blocks import Compliance
from calibration.robot.chain import chain_of_frames
from calibration.robot.parameter_block import Known
from calibration.stages.geometry.from_arrays import Widths, fit_chain
from tests.calibration.stages.geometry.test_from_arrays import LAB, X
from tests.doubles import rigid_robot

SIGMA, POSTURES, NEW, KNOWN = 2e-4, 40, 200, 12 + 7 * 8
SEEDS = range(1000, 2000)  # not used for development
BELIEVED = Widths(translation=4e-3, rotation=8e-3, offset=4e-2, reading=2e-3)  # what the truth is sampled from
LEAST = 1e-2  # of the widths random errors begin with: the least that is believed of them


def measured(truth, q, rng, share=LEAST):
    """Marker positions (n, 4, 3) [m] of a robot at joint angles q (n, 8), with noise and a share of the random errors
    that are expected."""
    w = BELIEVED
    q = q + share * w.reading * np.r_[0.1, np.ones(7)] * rng.normal(size=q.shape)
    hand = share * np.repeat([w.position, w.orientation], 3) * rng.normal(size=(len(q), 6))
    return rigid_robot.positions(LAB @ rigid_robot.hand_in_base(truth, q) @ exp6(hand), X) + SIGMA * rng.normal(
        size=(len(q), 4, 3)
    )


def drawn(chain, rng, soft=False):
    """A robot, readings (POSTURES + NEW, 8) of it, and the joint angles then; `soft`: a share of its gears gives, by as
    much as is believed of one that does, none against its load."""
    xi, zeros = rng.normal(size=(8, 6)) * np.repeat([4e-3, 8e-3], 3), rng.normal(size=8) * np.r_[4e-3, np.full(7, 4e-2)]
    reading = rigid_robot.random_angles(rng, POSTURES + NEW) + zeros
    tau = chain.gravity_torques(reading)
    gives = (
        Compliance.nominal(chain, np.zeros(12)).tolerance(Known(chain, None, tau[:POSTURES]))
        * np.abs(rng.normal(size=8))
        * (rng.random(8) < rng.random())
    )
    return rigid_robot.Truth(xi=xi, offset=zeros), reading, reading - zeros - soft * gives * tau


def judged(chain, seed, soft):
    """Of one robot, over NEW unseen hand poses: mean squared error and Cramer-Rao bound of position and rotation
    (2, 2), share of 95 % intervals that hold the truth, NEES, and the variance NEES would have.

    The bound is that of stiff gears.
    """
    rng = np.random.default_rng([seed, 31])
    truth, reading, q = drawn(chain, rng, soft)
    found = fit_chain(chain, reading[:POSTURES], measured(truth, q[:POSTURES], rng), BELIEVED)
    true = body_poses(found.markers, rigid_robot.positions(LAB @ rigid_robot.hand_in_base(truth, q[POSTURES:]), X)).T
    predicted = found.hand.poses_and_derivatives(reading[POSTURES:], names=found.parameters.names)
    J, scale = predicted.J, found.parameters.scale[:KNOWN]
    # The bound: the markers' noise alone is known, nothing is believed beforehand, no gear gives.
    noise = found.fit.at.B[:, :, -6:]
    A = (np.linalg.inv(np.linalg.cholesky(noise @ np.swapaxes(noise, 1, 2))) @ found.fit.at.J[:, :, :KNOWN]) * scale
    A = A.reshape(-1, KNOWN)
    G = J[:, :, :KNOWN] * scale
    bound = np.diagonal(
        G @ np.linalg.pinv(A.T @ A, rcond=1e-11, hermitian=True) @ np.swapaxes(G, 1, 2), axis1=1, axis2=2
    )
    error, stated = log6(inverse(true) @ predicted.T), J @ found.fit.covariance @ np.swapaxes(J, 1, 2)
    covered = (np.abs(error) <= 1.959964 * np.sqrt(np.diagonal(stated, axis1=1, axis2=2))).mean()
    white = np.linalg.inv(np.linalg.cholesky(stated))
    nees = ((white @ error[..., None]) ** 2).sum() / error.size
    M = (white @ J).reshape(error.size, -1)
    variance = 2.0 * ((M @ found.fit.covariance @ M.T) ** 2).sum() / error.size**2
    both = [[x[:, :3].mean(), x[:, 3:].mean()] for x in (error**2, bound)]
    return np.array(both), covered, nees, variance


@pytest.mark.slow
@pytest.mark.parametrize("soft", [False, True], ids=["stiff gears", "a share of the gears gives"])
def test_a_thousand_matched_robots_are_calibrated_as_well_as_noise_allows(soft, claim):
    chain = chain_of_frames(mjcf.urdf(), rigid_robot.JOINTS, "base_footprint", "gripper_grasping_frame")
    squares, covered, nees, variance = map(np.array, zip(*(judged(chain, s, soft) for s in SEEDS), strict=True))
    ratio = np.sqrt(squares[:, 0].mean(axis=0) / squares[:, 1].mean(axis=0))
    gears = "elastic gears" if soft else "stiff gears"
    claim(f"geometry/matched/{gears}, RMSE over the bound of stiff gears, position and rotation", ratio)
    assert soft or (ratio <= 1.1).all()
    nu = 2.0 * len(SEEDS) ** 2 / variance.sum()
    band = chi2.interval(0.99, nu) / nu
    claim(f"geometry/matched/{gears}, share of 95 % intervals", covered.mean())
    claim(f"geometry/matched/{gears}, NEES per degree of freedom", nees.mean())
    assert 0.93 <= covered.mean() <= 0.97
    assert band[0] <= nees.mean() <= band[1]
