"""Where a base is to go, and how its two driven wheels turn for it.

    v = (dx, dy) . (cos yaw, sin yaw),    left = (v - w b/2) / r,    right = (v + w b/2) / r        [rad/s]

w the yaw rate, b the track, r the wheels' radius: a differential drive without slip.
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

    def wheel_speeds(self, rate: float, track: float, radius: float) -> np.ndarray:
        """Speeds of the left and right wheel (n, 2) [rad/s] at set-points of a rate [Hz]."""
        step = np.diff(self.planar, axis=0, append=self.planar[-1:]) * rate
        ahead = step[:, 0] * np.cos(self.planar[:, 2]) + step[:, 1] * np.sin(self.planar[:, 2])
        aside = 0.5 * track * step[:, 2]
        return np.column_stack([ahead - aside, ahead + aside]) / radius
