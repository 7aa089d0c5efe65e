"""How much the markers of a body move against each other within a trial: mounts give way, cameras lose and find them.

    d_m(t) = R' (p_m - t) - x_m       since rest, slower than 10 Hz        R, t the rigid body that fits them best

m markers can move in 3 m directions. Six of these are a motion of the body; of the others each coordinate has its
share, sqrt(mean |d|^2 / (3 m - 6)), and a pose of the body is wrong by as much, which no residual shows.
"""

import numpy as np

from calibration.bodies import poses_of
from calibration.recording import Trial
from calibration.schema import Body
from calibration.signals import Signal, even, low_passed
from calibration.suspension_rest import REST
from calibration.suspension_wrench import CUTOFF


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
