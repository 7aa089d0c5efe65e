"""A hand seen as a point: a body of one or two markers, whose mean is a place and no pose.

    p = t + R c         c the markers' mean in the body's frame [m], (R, t) the body's pose
    dp = R (v - [c]x w)  of a local twist (v, w)

Its turns are not seen. What they do to the geometry is: 33 of the 36 combinations that poses tell, see `tests`.
"""

import numpy as np

from calibration.schema import Body
from calibration.se3 import skew


def is_point(body: Body) -> bool:
    """Whether its markers tell a place only."""
    return 0 < len(body.markers) < 3


def point_of(body: Body) -> np.ndarray:
    """c (3,) [m]."""
    return np.asarray(np.mean([m.xyz for m in body.markers], axis=0))


def places(T: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Where the point c (3,) of bodies at T (n, 4, 4) is, (n, 3) [m]."""
    return np.asarray(T[:, :3, :3] @ c + T[:, :3, 3])


def moved(R: np.ndarray, twists: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Derivatives (n, 3, m) of the place of c (3,) from those of the pose, local twists (n, 6, m), R (n, 3, 3)."""
    return np.asarray(R @ (twists[:, :3] - skew(c) @ twists[:, 3:]))
