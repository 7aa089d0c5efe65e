"""6D poses of a rigid body as six markers on its axes: the same information, so that every stage takes poses.

    markers at +-r e_x, +-r e_y, +-r e_z, each with noise s per axis:
    position covariance s^2 / 6,   rotation covariance s^2 / (4 r^2) per axis
    s = sqrt(6) sigma_p,           r = sqrt(6) sigma_p / (2 sigma_r)                      [m]

Which numbers are a rotation is declared. The robot confirms it: with nominal poses A_i of the hand's link and measured
ones B_i, B_i = X A_i Y has a solution in the right convention only. A convention that fits much better is named.
Reference: Horn, J. Opt. Soc. Am. A 1987 (pose of a body from points on it).
"""

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from calibration.errors import NotEnoughData
from calibration.formats.mapping.layouts import ANGLES, LENGTHS, PoseNumbers
from calibration.numerics.alignment import hand_eye
from calibration.numerics.lie import compose, inverse, rotation_vector

AXES = ("x+", "x-", "y+", "y-", "z+", "z-")
_DIRECTIONS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
_UNIT = 1e-2  # a quaternion may be off length 1 by this much [-]
_TURNS = 4.0 * np.pi  # [rad]
_FAR = 30.0  # [m]
_MUCH = 3.0  # times smaller misfit of another convention that refuses the declared one [-]
_NEAR = 0.03  # [-] misfit below which the declared one is not doubted: 30 mm, 60 mrad of a nominal robot
_METRES_PER_RAD = 0.5
_MIRRORS = {"x": np.diag([-1.0, 1.0, 1.0]), "y": np.diag([1.0, -1.0, 1.0]), "z": np.diag([1.0, 1.0, -1.0])}


def marker_names(body: str) -> tuple[str, ...]:
    """Of the six markers that stand for a body's pose."""
    return tuple(f"{body}.{axis}" for axis in AXES)


def shape_of(channels: PoseNumbers) -> np.ndarray:
    """The six markers (6, 3) [m, frame of the pose]."""
    return _DIRECTIONS * (np.sqrt(6.0) * channels.sigma_position / (2.0 * channels.sigma_rotation))


def marker_sigma(channels: PoseNumbers) -> float:
    """Noise s of each [m]."""
    return float(np.sqrt(6.0) * channels.sigma_position)


def rotations(numbers: np.ndarray, order: str) -> np.ndarray:
    """R (n, 3, 3) from the numbers (n, 3 or 4) of a row; NaN rows stay NaN. Angles in rad."""
    R = np.full((len(numbers), 3, 3), np.nan)
    good = np.isfinite(numbers).all(axis=1)
    if good.any():
        R[good] = _rotation(numbers[good], order).as_matrix()
    return R


def _rotation(x: np.ndarray, order: str) -> Rotation:
    if order.startswith("quat"):
        return Rotation.from_quat(x, scalar_first=order == "quat_wxyz")
    if order == "rotation_vector":
        return Rotation.from_rotvec(x)
    return Rotation.from_euler(order.removeprefix("euler_"), x)


def _numbers(R: np.ndarray, order: str) -> np.ndarray:
    rotation = Rotation.from_matrix(R)
    if order.startswith("quat"):
        return np.asarray(rotation.as_quat(scalar_first=order == "quat_wxyz"))
    if order == "rotation_vector":
        return np.asarray(rotation.as_rotvec())
    return np.asarray(rotation.as_euler(order.removeprefix("euler_")))


def wrong_numbers(position: np.ndarray, numbers: np.ndarray, channels: PoseNumbers) -> Iterator[str]:
    """What cannot be true of positions (n, 3) [m] and rotation numbers (n, 3 or 4), each finding once."""
    seen = np.abs(position[np.isfinite(position)])
    if len(seen) and float(np.median(seen)) > _FAR:
        yield f"positions are around {float(np.median(seen)):.0f} m: in millimetres? map position_unit: mm"
    good = numbers[np.isfinite(numbers).all(axis=1)]
    if not len(good):
        return
    if channels.order.startswith("quat"):
        off = float(np.median(np.abs(np.linalg.norm(good, axis=1) - 1.0)))
        if off > _UNIT:
            yield f"quaternions are {off:.2g} off length 1: other columns, or Euler angles; see order"
    elif float(np.abs(good).max()) > _TURNS:
        yield f"angles reach {float(np.abs(good).max()):.0f} rad: in degrees? map angle_unit: deg"


def markers_at(position: np.ndarray, numbers: np.ndarray, channels: PoseNumbers) -> np.ndarray:
    """Positions (n, 6, 3) [m] of the markers that stand for a pose, from its numbers as they are in the file.

    Raises:
        ValueError: They cannot be positions (n, 3) and rotations (n, 3 or 4) in these units; every finding.
    """
    p = LENGTHS[channels.position_unit] * position
    x = numbers * (1.0 if channels.order.startswith("quat") else ANGLES[channels.angle_unit])
    if wrong := "; ".join(wrong_numbers(p, x, channels)):
        raise ValueError(wrong)
    return np.asarray(np.einsum("nij,mj->nmi", rotations(x, channels.order), shape_of(channels)) + p[:, None])


def other_convention(A: np.ndarray, B: np.ndarray, order: str) -> str | None:
    """Say which convention the poses have when it is not the declared one, None where that fits the robot.

    Args:
        A: (n, 4, 4) nominal poses of the hand's link in the base's.
        B: (n, 4, 4) measured poses of the hand in the frame at rest, as declared.
        order: Declared.
    """
    good = np.isfinite(A).all(axis=(1, 2)) & np.isfinite(B).all(axis=(1, 2))
    A, B = A[good], B[good]
    declared = _misfit(A, B)
    if not np.isfinite(declared) or declared < _NEAR:
        return None
    found = {name: _misfit(A, other) for name, other in _others(B, order)}
    best = min(found, key=lambda name: found[name])
    if found[best] * _MUCH < declared:
        return best
    return None


def _others(B: np.ndarray, order: str) -> Iterator[tuple[str, np.ndarray]]:
    """The poses by other readings of the same numbers."""
    p, numbers = B[:, :3, 3], _numbers(B[:, :3, :3], order)
    orders = ("quat_xyzw", "quat_wxyz") if order.startswith("quat") else _THREE
    for name in orders:
        if name != order:
            yield f"order: {name}", compose(rotations(numbers, name), p)
    if not order.startswith("quat"):
        yield "angle_unit: deg", compose(rotations(np.radians(numbers), order), p)
    yield "rotations of the lab in the body (transposed)", compose(np.swapaxes(B[:, :3, :3], 1, 2), p)
    yield "poses of the lab in the body (inverted)", inverse(B)
    S = _MIRRORS["x"]  # which axis is mirrored cannot be determined: the frames' rotations are free
    yield "a left-handed frame, one axis mirrored", compose(S @ B[:, :3, :3] @ S, p @ S)
    for axis, S in _MIRRORS.items():
        yield f"positions with {axis} of opposite sign", compose(B[:, :3, :3], p @ S)
    yield "position_unit: mm", compose(B[:, :3, :3], 1e-3 * p)


def _misfit(A: np.ndarray, B: np.ndarray) -> float:
    """rms of B_i - X A_i Y, positions [m] and rotations at 0.5 m per rad; infinite where there is no solution."""
    try:
        X, Y = hand_eye(A, B)
    except NotEnoughData:
        return float("inf")
    E = inverse(B) @ X @ A @ Y
    r = np.concatenate([E[:, :3, 3], _METRES_PER_RAD * rotation_vector(E[:, :3, :3])], axis=1)
    return float(np.sqrt(np.median((r**2).sum(axis=1))))


_THREE = ("rotation_vector", *(f"euler_{s}" for s in ("xyz", "zyx", "XYZ", "ZYX")))
