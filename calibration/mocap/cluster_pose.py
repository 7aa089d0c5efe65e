"""Pose of a rigid marker cluster by least squares, all times at once.

    minimise sum_m w_m |p_m - (R x_m + t)|^2        p measured [m, lab], x nominal [m, body], w 1 where seen
    R  the rotation nearest to   sum_m w_m (p_m - p0)(x_m - x0)',     t = p0 - R x0

    minimum = sum_m w_m (|p_m - p0|^2 + |x_m - x0|^2) - 2 max_R trace(R' sum_m w_m (p_m - p0)(x_m - x0)')     [m2]

With noise sigma per axis and marker, the local twist (linear, angular) of the pose has covariance

    sigma^2 (sum_m A_m' A_m)^-1,   A_m = [I, -[x_m]x]            [m, rad]

Reference: Arun, Huang, Blostein, IEEE PAMI 1987; Umeyama, IEEE PAMI 1991.
"""

from dataclasses import dataclass, replace

import numpy as np

from calibration.errors import NotEnoughData, ShapeError
from calibration.numerics.alignment import nearest_rotations
from calibration.numerics.lie import compose, skew
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Body
from calibration.recording.trial import Trial

_WHOLE, _MANY = 50, 400  # samples that show a cluster's shape, at least; of which so many are looked at
_FLAT = 1e-6  # second singular value of a cluster over its first [-] below which it is a line
_ROUNDING = 1e-14  # of the squares of a cluster's size, below which a sum of squared distances is none [-]


@dataclass(frozen=True)
class BodyPoses:
    """Poses of a marker body.

    Attributes:
        T: (n, 4, 4) T_lab_body, NaN where fewer than 3 markers were seen.
        residual: (n, m, 3) measured minus fitted marker positions [m, lab], NaN where occluded.
        covariance: (n, 6, 6) of the local twist for 1 m of noise per axis; times sigma^2 [m, rad].
    """

    T: np.ndarray
    residual: np.ndarray
    covariance: np.ndarray


def body_poses(xyz: np.ndarray, positions: np.ndarray) -> BodyPoses:
    """Poses of a cluster with nominal markers xyz (m, 3) [m] from positions (n, m, 3) [m, lab], NaN = occluded."""
    if positions.ndim != 3 or positions.shape[1:] != xyz.shape:
        raise ShapeError("positions", positions.shape, ("n", *xyz.shape))
    seen = np.isfinite(positions).all(axis=2)
    w = seen.astype(float)[..., None]
    count = np.maximum(w.sum(axis=1), 1.0)
    p = np.where(seen[..., None], positions, 0.0)
    x0, p0 = (w * xyz).sum(axis=1) / count, p.sum(axis=1) / count
    R = nearest_rotations(np.swapaxes(w * (p - p0[:, None]), 1, 2) @ (xyz - x0[:, None]))
    T = compose(R, p0 - (R @ x0[..., None])[..., 0])
    covariance, usable = _covariances(xyz, seen)
    T[~usable] = np.nan
    fitted = (T[:, :3, :3] @ xyz.T + T[:, :3, 3:]).swapaxes(1, 2)
    return BodyPoses(T, np.where(seen[..., None], positions, np.nan) - fitted, covariance)


def misfit(xyz: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """rms distance (n,) [m] of markers (n, m, 3) from the rigid cluster xyz (m, 3); 0 where it has no pose."""
    seen = np.isfinite(positions).all(axis=2)
    w = (seen & _covariances(xyz, seen)[1][:, None]).astype(float)
    count = np.maximum(w.sum(axis=1), 1.0)
    x, p = xyz - xyz.mean(axis=0), np.where(seen[..., None], positions, 0.0)
    p = w[..., None] * (p - (np.einsum("nmi->ni", p) / count[:, None])[:, None])
    squares = np.einsum("nmi,nmi->n", p, p) + w @ (x**2).sum(axis=1) - ((w @ x) ** 2).sum(axis=1) / count
    B = np.tensordot(p, x, axes=(1, 0))
    left = squares - 2.0 * np.einsum("nij,nij->n", nearest_rotations(B), B)
    return np.asarray(np.sqrt(np.maximum(left, _ROUNDING * squares) / count))


def poses_as_seen(xyz: np.ndarray, positions: np.ndarray, every: np.ndarray) -> BodyPoses:
    """Poses from positions (n, m, 3) [m, lab] by the shape that a trial's samples `every` (k, m, 3) show.

    The shape is that of the samples with all markers, laid upon the drawing xyz (m, 3) [m, body]: a pose from some of
    the markers is the one that all of them would show, however far the drawing is off. Residuals are from the drawing,
    which is the shape where no marker is ever hidden, or too few samples show all.
    """
    if np.isfinite(every).all():
        return body_poses(xyz, positions)
    shape = shown_shape(xyz, every)
    found = body_poses(shape, positions)
    return replace(found, residual=found.residual + np.einsum("nij,mj->nmi", found.T[:, :3, :3], shape - xyz))


def shown_shape(xyz: np.ndarray, every: np.ndarray) -> np.ndarray:
    """Where samples `every` (k, m, 3) [m, lab] show the markers of a body (m, 3), by medians of those with all of them.

    Drawn xyz (m, 3) [m, body]; the drawing itself where too few samples show all.
    """
    whole = np.flatnonzero(np.isfinite(every).all(axis=(1, 2)))
    if len(whole) < _WHOLE:
        return xyz
    shown = body_poses(xyz, every[whole[:: max(1, len(whole) // _MANY)]])
    return np.asarray(xyz + np.median(np.einsum("nji,nmj->nmi", shown.T[:, :3, :3], shown.residual), axis=0))


def poses_of(body: Body, trial: Trial) -> BodyPoses:
    """Poses of a marker body throughout a trial, at its `t_mocap`; a body without markers is the positions' own frame.

    Raises:
        NotEnoughData: The trial does not record three of its markers.
    """
    if not body.markers:
        return still_poses(len(trial.t_mocap))
    recorded = {name: i for i, name in enumerate(trial.marker)}
    markers = [m for m in body.markers if m.name in recorded]
    if len(markers) < 3:
        raise NotEnoughData(f"{trial.id}: body {body.name!r} needs 3 markers, {[m.name for m in markers]} are recorded")
    positions = trial.marker_position[:, [recorded[m.name] for m in markers]]
    return poses_as_seen(np.array([m.xyz for m in markers]), positions, positions)


def poses_of_means(body: Body, means: PostureMeans) -> BodyPoses:
    """Poses of a marker body (n, 4, 4); their covariance in [m, rad], already with the markers' own noise.

    Raises:
        NotEnoughData: Fewer than three of its markers are in the file.
    """
    if not body.markers:
        return still_poses(len(means))
    names = [m.name for m in body.markers if m.name in means.marker]
    if len(names) < 3:
        raise NotEnoughData(f"{means.id}: body {body.name!r} needs 3 markers, {names} are in the file")
    columns = [means.marker.index(name) for name in names]
    xyz = np.array([m.xyz for m in body.markers if m.name in names])
    found = body_poses(xyz, means.marker_position[:, columns])
    variance = np.nanmean(means.marker_position_std[:, columns] ** 2, axis=(1, 2))
    return replace(found, covariance=found.covariance * variance[:, None, None])


def point_of_means(body: Body, means: PostureMeans) -> tuple[np.ndarray, np.ndarray]:
    """Mean position (n, 3) [m] of a body's markers, NaN unless all are seen, and its variance per axis (n,) [m2].

    Raises:
        NotEnoughData: One of them is not in the file.
    """
    missing = [m.name for m in body.markers if m.name not in means.marker]
    if missing:
        raise NotEnoughData(f"{means.id}: markers {missing} of body {body.name!r} are not in the file")
    columns = [means.marker.index(m.name) for m in body.markers]
    squares = means.marker_position_std[:, columns] ** 2
    return means.marker_position[:, columns].mean(axis=1), squares.mean(axis=(1, 2)) / len(columns)


def still_poses(n: int) -> BodyPoses:
    """Poses of the body whose frame the marker positions are in: the identity, exactly, n times."""
    return BodyPoses(np.tile(np.eye(4), (n, 1, 1)), np.full((n, 0, 3), np.nan), np.zeros((n, 6, 6)))


def _covariances(xyz: np.ndarray, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit covariance (n, 6, 6) and whether the visible markers fix a pose (n,), once per visibility pattern."""
    if len(seen) and seen.all():
        patterns, which = seen[:1], np.zeros(len(seen), dtype=int)
    else:
        _, first, which = np.unique(np.packbits(seen, axis=1), axis=0, return_index=True, return_inverse=True)
        patterns, which = seen[first], which.reshape(len(seen))
    covariance = np.full((len(patterns), 6, 6), np.nan)
    for k, pattern in enumerate(patterns):
        x = xyz[pattern]
        spread = np.linalg.svd(x - x.mean(axis=0), compute_uv=False) if len(x) >= 3 else np.zeros(2)
        if spread[1] > _FLAT * max(spread[0], np.finfo(float).tiny):
            A = np.concatenate([np.broadcast_to(np.eye(3), (len(x), 3, 3)), -skew(x)], axis=2)
            covariance[k] = np.linalg.inv(np.einsum("mij,mik->jk", A, A))
    usable = np.isfinite(covariance[:, 0, 0])
    if len(patterns) == 1:
        return np.broadcast_to(covariance[0], (len(seen), 6, 6)), np.broadcast_to(usable[0], len(seen))
    return covariance[which], usable[which]
