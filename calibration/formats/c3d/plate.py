"""Force plates as C3D has them: corners, a transducer origin, channels in plate axes with z DOWN, reaction or action.

    x = c1 - c2, y = c1 - c4, z = x x y downwards      corners c1..c4 = (+x+y, -x+y, -x-y, +x-y) in plate axes
    f_lab = R f,   m_centre = R (m_o - r x f)          r = ORIGIN: transducer origin to surface centre, z negative

Channels of type 2 are Fx Fy Fz Mx My Mz about the transducer origin; of type 4 they are volts, F = CAL_MATRIX V.
Nobody flips signs on the way: what is stored is what a reader gets, and laboratories store the REACTION.
Source: C3D user guide, FORCE_PLATFORM group.
"""

from dataclasses import dataclass, replace

import numpy as np

from calibration.recording.schema import Plate

_SKEWED = 0.02  # largest believable cosine between two edges of a plate [-]


@dataclass(frozen=True)
class C3dPlate:
    """Parameters of one plate, SI.

    Attributes:
        type: 2 or 4.
        corners: (3, 4) [m, lab].
        origin: (3,) transducer origin to surface centre [m, plate axes].
        matrix: (6, 6) channels to forces [N] and moments [N.m]; the identity for type 2.
    """

    type: int
    corners: np.ndarray
    origin: np.ndarray
    matrix: np.ndarray

    @property
    def centre(self) -> np.ndarray:
        """Surface centre (3,) [m, lab]."""
        return self.corners.mean(axis=1)

    @property
    def size(self) -> tuple[float, float]:
        """Edge lengths along x and y [m]."""
        c = self.corners
        return float(np.linalg.norm(c[:, 0] - c[:, 1])), float(np.linalg.norm(c[:, 0] - c[:, 3]))

    @property
    def axes(self) -> np.ndarray:
        """R (3, 3), the plate's axes as columns in the lab; z is x cross y, wherever that points.

        Raises:
            ValueError: The corners are no rectangle.
        """
        x, y = self.corners[:, 0] - self.corners[:, 1], self.corners[:, 0] - self.corners[:, 3]
        lengths = np.linalg.norm(x), np.linalg.norm(y)
        if min(lengths) == 0.0 or abs(x @ y) > _SKEWED * lengths[0] * lengths[1]:
            raise ValueError("the four corners are no rectangle in the order +x+y, -x+y, -x-y, +x-y")
        x = x / lengths[0]
        z = np.cross(x, y)
        z = z / np.linalg.norm(z)
        return np.stack([x, np.cross(z, x), z], axis=1)


def lab_wrench(plate: C3dPlate, channels: np.ndarray) -> np.ndarray:
    """Wrench (n, 6) [N, N.m] as stored, lab axes, about the surface centre, of channels (n, 6)."""
    raw, R = channels @ plate.matrix.T, plate.axes
    f, m = raw[:, :3], raw[:, 3:]
    return np.concatenate([f @ R.T, (m - np.cross(plate.origin, f)) @ R.T], axis=1)


def channels_of(plate: C3dPlate, wrench: np.ndarray) -> np.ndarray:
    """Channels (n, 6) that store a wrench (n, 6), the inverse of `lab_wrench`."""
    R = plate.axes
    f, m = wrench[:, :3] @ R, wrench[:, 3:] @ R
    return np.concatenate([f, m + np.cross(plate.origin, f)], axis=1) @ np.linalg.inv(plate.matrix).T


def drawn_plate(plate: Plate, depth: float = 0.0) -> C3dPlate:
    """A plate of a dataset as C3D has it, its transducers `depth` [m] below the surface."""
    x, y, z = (np.array(axis) for axis in plate.axes)
    if z[2] > 0.0:
        y, z = -y, -z
    half_x, half_y = 0.5 * plate.size[0] * x, 0.5 * plate.size[1] * y
    corners = [half_x + half_y, -half_x + half_y, -half_x - half_y, half_x - half_y]
    c = np.stack(corners, axis=1) + np.array(plate.centre)[:, None]
    return C3dPlate(2, c, np.array([0.0, 0.0, -depth]), np.eye(6))


def negated_origin(plate: C3dPlate) -> C3dPlate:
    """The plate with its origin turned round, for files that store surface centre to transducer."""
    return replace(plate, origin=-plate.origin)
