"""Shape of a rigid marker cluster nobody drew, from its measured positions alone.

Median squared distances between markers over all postures give coordinates by classical scaling,

    B = -1/2 H D H,   X = eigenvectors of B, largest three, times the roots of their values        H centres

then the mean of the clusters laid upon each other. Origin at the mean marker, axes along the principal ones. A posture
whose cluster does not fit the shape has a label swapped or a ghost in it: it is identified by its misfit.
Reference: Torgerson, Psychometrika 1952; Gower, Psychometrika 1975.

How much the markers of a body move against each other within a trial: mounts give way, cameras lose and find them.

    d_m(t) = R' (p_m - t) - x_m       since rest, slower than 10 Hz        R, t the rigid body that fits them best

m markers can move in 3 m directions. Six of these are a motion of the body; of the others each coordinate has its
share, sqrt(mean |d|^2 / (3 m - 6)), and a pose of the body is wrong by as much, which no residual shows.
"""

from dataclasses import dataclass

import numpy as np

from calibration.mocap.cluster_pose import body_poses, poses_of
from calibration.numerics.signals import CUTOFF, Signal, even, low_passed
from calibration.recording.schema import Body
from calibration.recording.trial import REST, Trial

_MANY = 200  # postures the first guess is made from
_FEW = 50  # that show whether it is to be mirrored
_ODD = 6.0  # a posture's misfit over the median one's beyond which its markers are not that body's [-]
_FLAT = 1e-3  # third-largest-but-one extent over the largest below which markers stand in line [-]


@dataclass(frozen=True)
class Cluster:
    """A rigid cluster and where it was.

    Attributes:
        xyz: (m, 3) markers in its own frame [m].
        T: (n, 4, 4) its poses.
        covariance: (n, 6, 6) of their local twists [m, rad].
        sigma: Noise of a marker per axis [m].
        odd: (n,) whether a posture's markers do not have that shape.
    """

    xyz: np.ndarray
    T: np.ndarray
    covariance: np.ndarray
    sigma: float
    odd: np.ndarray


def in_line(positions: np.ndarray) -> bool:
    """Whether markers (n, m, 3) [m] are fewer than three or stand in a line, so that they have no rotation."""
    if positions.shape[1] < 3:
        return True
    values, _ = _scaled(positions)
    return bool(values[1] < _FLAT**2 * max(values[0], np.finfo(float).tiny))


def cluster(positions: np.ndarray) -> Cluster:
    """The cluster of markers (n, m, 3) [m], m >= 3 and not in line, NaN where one was not seen."""
    values, vectors = _scaled(positions)
    xyz = vectors * np.sqrt(np.maximum(values, 0.0))
    m, some = positions.shape[1], _some(positions, _FEW)
    mirrored, upright = (misfit(body_poses(xyz * [1.0, 1.0, z], some).residual) for z in (-1.0, 1.0))
    if np.nanmedian(mirrored) < np.nanmedian(upright):
        xyz = xyz * [1.0, 1.0, -1.0]
    found = body_poses(xyz, positions)
    good = of_one_shape(misfit(found.residual))
    R, p = found.T[good, :3, :3], found.T[good, :3, 3]
    xyz = np.nanmean((positions[good] - p[:, None]) @ R, axis=0)
    found = body_poses(xyz, positions)
    odd = ~of_one_shape(misfit(found.residual))
    dof = np.isfinite(found.residual[~odd]).sum() - 6 * (~odd).sum() - (3 * m - 6)
    sigma = float(np.sqrt(np.nansum(found.residual[~odd] ** 2) / max(1, dof)))
    return Cluster(xyz, found.T, found.covariance * sigma**2, sigma, odd)


def of_one_shape(misfit: np.ndarray) -> np.ndarray:
    """Whether each of the clusters with these misfits (n,) has the shape that most have."""
    return np.asarray(misfit <= _ODD * np.nanmedian(misfit))


def misfit(residual: np.ndarray) -> np.ndarray:
    """Root mean squared residual (n,) of residuals (n, m, 3); NaN where there are none."""
    seen = np.isfinite(residual)
    count = seen.sum(axis=(1, 2))
    total = np.where(seen, residual, 0.0)
    return np.sqrt((total**2).sum(axis=(1, 2)) / np.where(count > 0, count, np.nan))


def _scaled(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Three largest eigenvalues (3,) and their vectors (m, 3) of the centred squared distances."""
    positions, m = _some(positions, _MANY), positions.shape[1]
    D = np.zeros((m, m))
    for i in range(m):
        for j in range(i):
            D[i, j] = D[j, i] = np.nanmedian(((positions[:, i] - positions[:, j]) ** 2).sum(axis=1))
    H = np.eye(m) - 1.0 / m
    values, vectors = np.linalg.eigh(-0.5 * H @ D @ H)
    return values[::-1][:3], vectors[:, ::-1][:, :3]


def _some(positions: np.ndarray, many: int) -> np.ndarray:
    """Evenly spread postures, few enough for a first guess."""
    return positions[np.unique(np.linspace(0, len(positions) - 1, many).astype(int))]


def shape_change(body: Body, trial: Trial) -> Signal:
    """d (n, 3 m) [m, body] of a body's markers since the first second, on an even grid of the markers' clock [s].

    Raises:
        NotEnoughData: Three markers, or a second of samples, are missing.
    """
    found = poses_of(body, trial)
    local = np.einsum("nji,nmj->nmi", found.T[:, :3, :3], found.residual)
    d = low_passed(even(trial.t_mocap, local.reshape(len(local), -1)), CUTOFF)
    return Signal(d.t, d.x - d.x[d.t <= d.t[0] + REST].mean(axis=0), d.valid)


def per_coordinate(d: np.ndarray) -> float:
    """Root of the mean square of d (n, 3 m) that each coordinate of a marker has [m]."""
    return float(np.sqrt(np.square(d).sum(axis=1).mean() / free(d.shape[1] // 3)))


def free(markers: int) -> int:
    """Directions in which markers can move against each other."""
    return max(3 * markers - 6, 1)
