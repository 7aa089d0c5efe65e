"""The base frame as Heins computes it, eq. 3 and 4: the start of our fit, and what it is compared with.

    centre    minimise over r   sum_i |R_i r + p_i - R_0 r - p_0|^2       linear: (R_i - R_0) r = p_0 - p_i
    forward   mean over i of    atan2(y_i, x_i),   (x_i, y_i) = R_0' (c_i - c_0)

with T_lab_B(i) = (R_i, p_i), r the centre in the axes of B, so A = C_i - C_0 as in his code. Read with an offset
that is constant in the world, as the text prints it, the minimiser is the mean of the p_i and no centre. Every row
leans on rest 0, whose noise all of them share, and every sample of the drive counts alike, the first as the last.
Reference: Heins, mobile_manipulation_central, calibration notes and code, 2022.
"""

from dataclasses import dataclass

import numpy as np

from calibration.stages.frames.base_rests import Stations


@dataclass(frozen=True)
class Printed:
    """Heins's answer.

    Attributes:
        centre: (3,) of rotation in B, no component along the axis [m].
        forward: Direction of travel in B, from its x towards its y [rad]; NaN without a drive.
    """

    centre: np.ndarray
    forward: float

    def start(self, nominal: np.ndarray) -> np.ndarray:
        """T_base_B (6,) of this centre and direction, all else nominal [m, rad]."""
        yaw = nominal[5] if np.isnan(self.forward) else -self.forward
        k, s = np.cos(yaw), np.sin(yaw)
        x, y, _ = self.centre
        return np.array([-k * x + s * y, -s * x - k * y, nominal[2], 0.0, 0.0, yaw])


def printed_base_frame(stations: Stations) -> Printed:
    """Centre over all spins, each leaning on its own first rest; direction over all drives."""
    A, b, angles = [], [], []
    for trial, kind in enumerate(stations.kinds):
        if kind == "spin":
            T = stations.T[stations.trial == trial]
            A.append((T[1:, :3, :3] - T[0, :3, :3]).reshape(-1, 3))
            b.append((T[0, :3, 3] - T[1:, :3, 3]).ravel())
    r = np.linalg.lstsq(np.concatenate(A), np.concatenate(b), rcond=1e-3)[0]
    for trial, kind in enumerate(stations.kinds):
        if kind == "drive":
            T = stations.T[stations.trial == trial]
            c = (T[1:, :3, :3] @ r + T[1:, :3, 3] - T[0, :3, :3] @ r - T[0, :3, 3]) @ T[0, :3, :3]
            angles.append(np.arctan2(c[:, 1], c[:, 0]))
    return Printed(r, float(np.concatenate(angles).mean()) if angles else float("nan"))
