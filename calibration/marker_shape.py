"""Shape of a rigid marker cluster nobody drew, from its measured positions alone.

Median squared distances between markers over all postures give coordinates by classical scaling,

    B = -1/2 H D H,   X = eigenvectors of B, largest three, times the roots of their values        H centres

then the mean of the clusters laid upon each other. Origin at the mean marker, axes along the principal ones. A posture
whose cluster does not fit the shape has a label swapped or a ghost in it: it is told by its misfit.
Reference: Torgerson, Psychometrika 1952; Gower, Psychometrika 1975.
"""

from dataclasses import dataclass

import numpy as np

from calibration.bodies import body_poses

_MANY = 200  # postures the first guess is made from
_FEW = 50  # that tell whether it is to be mirrored
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
