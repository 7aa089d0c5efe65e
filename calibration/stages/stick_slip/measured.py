"""What the base did in the floor's plane, by its markers and a tilt that is known better than they show it.

    x = u_x - (z c_y..): the markers' centroid c moves by u = t + theta x c, so
    t_x = u_x - ry c_z + rz c_y,     t_y = u_y - rz c_x + rx c_z

The markers stand 0.3 m above the floor and 0.4 m apart: their own tilt would add its noise times 0.3 m to t, which is
twice that of u. The tilt (rx, ry) is therefore the compliance's. Means over blocks of 50 ms, of the measured and of the
predicted motion alike, stand for an anti-aliasing filter.

How far the base has slid is what its markers show beyond its compliance under the plate's wrench.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.signals import GAP, RATE, Signal
from calibration.recording.schema import Description
from calibration.recording.trial import REST, Trial
from calibration.stages.stick_slip.forcing import PlanarForcing
from calibration.stages.stick_slip.kernel.bases import HEAVE, PLANE
from calibration.stages.suspension.base_response import base_response_of
from calibration.stages.suspension.floor_wrench import Load
from calibration.stages.suspension.modal_response import predicted
from calibration.stages.suspension.model import Suspension
from calibration.stages.suspension.rest_frame import Rest

BLOCK = 5  # samples averaged together


@dataclass(frozen=True)
class PlanarMotion:
    """Measured motion of one trial on the forcing's grid, means of blocks, b of them.

    Attributes:
        x: (b, 3) x, y, yaw [m, rad] since the first second, frame 0.
        valid: (b,) False where markers are missing.
        noise: (3,) standard deviation of a block, from the first second.
        tilted: (b, 3) z, rx, ry beyond the forcing's; NaN where markers are missing.
    """

    x: np.ndarray
    valid: np.ndarray
    noise: np.ndarray
    tilted: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))


def planar_motion(description: Description, trial: Trial, rest: Rest, forcing: PlanarForcing) -> PlanarMotion:
    """The base's motion as its markers show it.

    Raises:
        NotEnoughData: They are missing in most of the first second.
    """
    body = description.base_body
    d = rest.displacement(MeasuredTrial.of(description, trial).base.T)
    good = np.isfinite(d).all(axis=1)
    t, n = trial.t_mocap[good], len(forcing.t)
    x = np.stack([np.interp(forcing.t, t, column) for column in d[good].T], axis=1)
    right = np.clip(np.searchsorted(t, forcing.t), 1, len(t) - 1)
    seen = (np.diff(t)[right - 1] <= GAP) & (forcing.t >= t[0]) & (forcing.t <= t[-1])
    c_z = float(rest.T_0_B[2, 3] + (rest.T_0_B[:3, :3] @ np.mean([m.xyz for m in body.markers], axis=0))[2])
    excess = x[:, HEAVE] - forcing.heave
    plane = np.column_stack([x[:, 0] + c_z * excess[:, 2], x[:, 1] - c_z * excess[:, 1], x[:, 5]])
    early = forcing.rest & seen
    if early.sum() < 0.5 * REST * RATE:
        raise NotEnoughData(f"{trial.id}: base markers are missing in most of the first second")
    plane = plane - plane[early].mean(axis=0)
    noise = blocks(plane[early]).std(axis=0, ddof=1)
    b = n // BLOCK
    valid = seen[: b * BLOCK].reshape(b, BLOCK).all(axis=1)
    return PlanarMotion(blocks(plane), valid, noise, np.where(valid[:, None], blocks(excess), np.nan))


def slid(description: Description, trial: Trial, rest: Rest, plate: Load, suspension: Suspension) -> Signal | None:
    """x, y, yaw (n, 3) [m, rad, frame 0] by which the base has slid, at the times its markers are seen.

    None where markers and wrench overlap for less than two seconds.
    """
    try:
        seen = base_response_of(description, trial, rest, plate)
    except NotEnoughData:
        return None
    good = seen.valid
    if not good.any():
        return None
    x = seen.x - predicted(suspension.K, suspension.C, seen.forcing)
    return Signal(seen.forcing.t[good], x[good][:, PLANE], np.ones(int(good.sum()), dtype=bool))


def blocks(x: np.ndarray) -> np.ndarray:
    """Means (b, c) of successive BLOCK samples of x (n, c)."""
    b = len(x) // BLOCK
    return np.asarray(x[: b * BLOCK].reshape(b, BLOCK, x.shape[1]).mean(axis=1))


def pooled_noise(motions: Sequence[PlanarMotion]) -> np.ndarray:
    """(3,) noise of a block over all trials."""
    return np.sqrt(np.mean([m.noise**2 for m in motions], axis=0))
