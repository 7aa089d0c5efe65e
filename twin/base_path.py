"""Where a base is to go, and how its two driven wheels turn for it.

    left = (way - yaw b/2) / r,    right = (way + yaw b/2) / r,    d way = (dx, dy) . (cos yaw, sin yaw)

b the track, r the wheels' radius: a differential drive without slip; yaw in the middle of each step.
"""

from dataclasses import dataclass

import numpy as np

from twin.config_driving import Form
from twin.conventions import exp6


@dataclass(frozen=True)
class BasePath:
    """Path of the base during a motion.

    Attributes:
        form: kinematic: it is there; wheels: it is meant to get there.
        planar: x, y [m] and yaw [rad] in the base frame at the start, (n, 3), one a set-point.
    """

    form: Form
    planar: np.ndarray

    def poses(self) -> np.ndarray:
        """T_start_base (n, 4, 4)."""
        T = exp6(np.column_stack([np.zeros((len(self.planar), 5)), self.planar[:, 2]]))
        T[:, :2, 3] = self.planar[:, :2]
        return T

    def wheel_angles(self, track: float, radius: float) -> np.ndarray:
        """Angles of the left and right wheel (n, 2) [rad] for a track and a wheel's radius [m], from zero."""
        step, yaw = np.diff(self.planar, axis=0), self.planar[:, 2]
        middle = 0.5 * (yaw[1:] + yaw[:-1])
        way = np.concatenate([[0.0], np.cumsum(step[:, 0] * np.cos(middle) + step[:, 1] * np.sin(middle))])
        aside = 0.5 * track * (yaw - yaw[0])
        return np.column_stack([way - aside, way + aside]) / radius
