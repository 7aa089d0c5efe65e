"""Rests of a base that spins and drives, made by the equations of `calibration.base_frame` alone."""

import numpy as np

from calibration.mocap.cluster_pose import body_poses
from calibration.numerics.lie import compose, from_vector
from calibration.stages.frames.base_rests import Stations, from_planar
from tests.doubles import rigid_robot

MARKERS = np.array([[0.21, 0.17, 0.31], [0.21, -0.17, 0.31], [-0.20, -0.17, 0.32], [-0.20, 0.17, 0.30]])
TRUE = np.array([4e-3, -3e-3, 1.5e-3, 6e-3, -4e-3, 12e-3])
TILT = np.array([1.5e-3, -0.8e-3])
FLOOR = np.array(rigid_robot.described().plates[0].centre)
EVERY = np.ones(6, dtype=bool)
SIGMA = 1e-4 / np.sqrt(80.0)


def path(wander: float = 0.0, spins: int = 12, drives: int = 8, rng=None, span: float = 2 * np.pi):
    """Planar poses (n, 3), trial index and kinds: a spin in steps, then a drive; s [m] a step in both."""
    rng = rng or np.random.default_rng(0)
    yaw = 0.3 + span * np.arange(spins) / spins
    planar = [np.column_stack([0.02 + np.zeros(spins), -0.05 + np.zeros(spins), yaw])]
    planar[0][1:, :2] += np.cumsum(wander * rng.normal(size=(spins - 1, 2)), axis=0)
    index, kinds = [0] * spins, ("spin",)
    if drives:
        way, heading = 0.1 * np.arange(drives), 0.7
        slip = np.concatenate([[0.0], np.cumsum(wander * rng.normal(size=drives - 1))])
        ahead, aside = np.array([np.cos(heading), np.sin(heading)]), np.array([-np.sin(heading), np.cos(heading)])
        xy = np.array([0.1, 0.2]) + way[:, None] * ahead + slip[:, None] * aside
        planar.append(np.column_stack([xy, np.full(drives, heading)]))
        index, kinds = index + [1] * drives, ("spin", "drive")
    return np.concatenate(planar), np.array(index), kinds


def stations(planar, index, kinds, sigma: float = 0.0, rng=None, base=TRUE, tilt=TILT) -> Stations:
    """Measured rests; `sigma` [m] of a marker's mean, also where it is not added."""
    floor = compose(from_vector(np.array([0.0, 0.0, 0.0, *tilt, 0.0]))[:3, :3], FLOOR)
    T = floor @ from_planar(planar) @ from_vector(base)
    p = np.einsum("nij,kj->nki", T[:, :3, :3], MARKERS) + T[:, None, :3, 3]
    if rng is not None:
        p = p + sigma * rng.normal(size=p.shape)
    found = body_poses(MARKERS, p)
    return Stations(found.T, found.covariance * (sigma or SIGMA) ** 2, index, kinds, kinds)
