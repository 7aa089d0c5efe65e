"""Poses of a body in dwells that show one or two of its markers, by where the other dwells say it is to be expected.

    minimise  sum_m |T x_m - p_m|^2 n / sigma^2 + d' P^-1 d      d = log6(E^-1 T)      over the pose T of the body

p_m is the mean of a marker over the n samples of a dwell, x_m its place in the body [m]. Two markers determine five of
six directions to their noise, one three; the others have the expected pose E and covariance P, that of d over the
dwells of the trial that show three markers. A base is expected at the mean of its poses, a hand where the nominal robot
has it, X and Y by these dwells, with the covariance of the base's own pose in P:

    E_base = mean T_lab_base        E_hand = T_lab_base X T_nominal(q) Y
"""

from dataclasses import dataclass, replace

import numpy as np

from calibration.errors import NotEnoughData
from calibration.mocap.cluster_pose import BodyPoses
from calibration.numerics.alignment import hand_eye
from calibration.numerics.lie import adjoint, exp6, inverse, log6, mean, skew

_FEWEST = 9  # dwells that show a body and what its poses scatter by
_FINEST = 1e-6  # of what poses scatter by [m, rad]
_STEPS = 6


@dataclass(frozen=True)
class Markers:
    """Markers of a body in the n dwells of a trial.

    Attributes:
        xyz: (m, 3) places in the body [m].
        position: (n, m, 3) means over each dwell, NaN where hidden [m, lab].
        poses: Of the body, NaN where fewer than three are seen.
    """

    xyz: np.ndarray
    position: np.ndarray
    poses: BodyPoses


def completed(base: Markers, hand: Markers, tool: np.ndarray, variance: float) -> tuple[BodyPoses, BodyPoses]:
    """Poses of base and hand, those by one or two markers among them.

    tool: (n, 4, 4) nominal pose of the tool in the robot's base. variance: Of a marker's mean per axis [m2].
    """
    of_base, T = base.poses, inverse(base.poses.T) @ hand.poses.T
    if _enough(of_base.T):
        of_base = _by_few(base, np.broadcast_to(mean(of_base.T), of_base.T.shape), 0.0, variance)
    if not _enough(T):
        return of_base, hand.poses
    try:
        X, Y = hand_eye(tool, T)
    except NotEnoughData:
        return of_base, hand.poses
    T_base_hand = X @ tool @ Y
    Ad = adjoint(inverse(T_base_hand))
    return of_base, _by_few(hand, of_base.T @ T_base_hand, Ad @ of_base.covariance @ np.swapaxes(Ad, 1, 2), variance)


def _enough(T: np.ndarray) -> bool:
    return int(np.isfinite(T).all(axis=(1, 2)).sum()) >= _FEWEST


def _by_few(body: Markers, expected: np.ndarray, unsure: np.ndarray | float, variance: float) -> BodyPoses:
    """The poses of a body, filled in where it is expected (n, 4, 4) and one or two of its markers are seen.

    unsure: (n, 6, 6) covariance of what is expected over a marker's variance.
    """
    found, seen = body.poses, np.isfinite(body.position).all(axis=2)
    known, whole = (np.isfinite(T).all(axis=(1, 2)) for T in (expected, found.T))
    d = log6(inverse(expected[known & whole]) @ found.T[known & whole])
    spread = (d.T @ d / (len(d) - 2) + _FINEST**2 * np.eye(6)) / variance
    prior = np.linalg.inv(np.broadcast_to(spread + unsure, (len(seen), 6, 6)))
    T, covariance, residual = found.T.copy(), np.array(found.covariance), found.residual.copy()
    for k in np.flatnonzero(known & ~whole & seen.any(axis=1)):
        x, p = body.xyz[seen[k]], body.position[k, seen[k]]
        T[k], covariance[k] = _pose(x, p, expected[k], prior[k])
        residual[k, seen[k]] = p - (x @ T[k, :3, :3].T + T[k, :3, 3])
    return replace(found, T=T, covariance=covariance, residual=residual)


def _pose(x: np.ndarray, p: np.ndarray, expected: np.ndarray, prior: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pose (4, 4) by markers x (k, 3) at p (k, 3), and the covariance (6, 6) of its twist over a marker's variance."""
    A = np.concatenate([np.broadcast_to(np.eye(3), (len(x), 3, 3)), -skew(x)], axis=2).reshape(-1, 6)
    H, T = A.T @ A + prior, expected
    for _ in range(_STEPS):
        r = (p - T[:3, 3]) @ T[:3, :3] - x
        T = T @ exp6(np.linalg.solve(H, A.T @ r.ravel() - prior @ log6(inverse(expected) @ T)))
    return T, np.linalg.inv(H)
