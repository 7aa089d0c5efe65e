"""Poses of the base's marker body on a floor, and their derivatives.

T_lab_B(i) = T_lab_floor  E(x_i, y_i, phi_i)  S_t  T_base_B

floor    through a known point, tilted by (a, b) about the lab's x and y
E        pose of an upright base on the floor
S_t      how the base stands in trial t: height and tilt (dz, rx, ry), the same at every heading

Rests of spins and drives: where the base's marker body stood, with covariance, in the order they were made.

Means over each dwell, as in `postures`; the local twist of a mean has covariance S = f C_B sigma^2 / n.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from calibration.errors import NotEnoughData
from calibration.mocap.postures import BLOCKS, dwell_windows, inflation, mean_poses
from calibration.numerics.lie import adjoint, compose, from_vector, inverse, local_twist, rotation_vector, to_vector
from calibration.recording.schema import Description, Kind
from calibration.recording.trial import Trial

_STANDS = [2, 3, 4]  # of a frame's vector
MOVES: tuple[Kind, ...] = ("spin", "drive")
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Common:
    """What the rests share.

    Attributes:
        base: (6,) translation and rotation vector of T_base_B [m, rad].
        tilt: (2,) of the floor [rad].
        standing: (n_trials, 3) dz, rx, ry of the base frame in each trial [m, rad, rad].
    """

    base: np.ndarray
    tilt: np.ndarray
    standing: np.ndarray

    def moved(self, step: np.ndarray) -> "Common":
        """By a step (8 + 3 n_trials,)."""
        return Common(self.base + step[:6], self.tilt + step[6:8], self.standing + step[8:].reshape(-1, 3))


def from_planar(planar: np.ndarray) -> np.ndarray:
    """E (n, 4, 4) of x, y [m] and heading [rad] (n, 3)."""
    zeros = np.zeros(len(planar))
    return from_vector(np.column_stack([planar[:, :2], zeros, zeros, zeros, planar[:, 2]]))


@dataclass(frozen=True)
class Stations:
    """Rests of all spins and drives.

    Attributes:
        T: (n, 4, 4) T_lab_B.
        covariance: (n, 6, 6) of its local twist [m, rad].
        trial: (n,) index of the trial, ascending.
        kinds: Of each trial, `spin` or `drive`.
        ids: Of each trial.
    """

    T: np.ndarray
    covariance: np.ndarray
    trial: np.ndarray
    kinds: tuple[Kind, ...]
    ids: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.T)


def residuals(
    common: Common, planar: np.ndarray, stations: Stations, floor: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Residuals (n, 6) [m, rad], R_meas' (p - p_meas) and log3(R_meas' R), with derivatives.

    Args:
        common: Base, floor and standing.
        planar: (n, 3) x, y [m] and heading [rad] of each rest.
        stations: The measured poses.
        floor: Origin of the floor in the lab (3,) [m].

    Returns:
        r (n, 6); by what is common (n, 6, 8 + 3 n_trials); by the planar poses (n, 6, 3).
    """
    T_base_B, turn = from_vector(common.base), np.array([*common.tilt, 0.0])
    vectors = np.zeros((len(common.standing), 6))
    vectors[:, _STANDS] = common.standing
    E, S_B = from_planar(planar), (from_vector(vectors) @ T_base_B)[stations.trial]
    T = compose(pin.exp3(turn), floor) @ E @ S_B
    R_t = np.swapaxes(stations.T[:, :3, :3], 1, 2)
    error = R_t @ T[:, :3, :3]
    shift = (R_t @ (T[:, :3, 3] - stations.T[:, :3, 3])[..., None])[..., 0]
    twist_d = np.zeros((len(E), 6, 3))
    twist_d[:, :3, :2], twist_d[:, 5, 2] = np.swapaxes(E[:, :3, :3], 1, 2)[:, :, :2], 1.0
    twist_tilt = np.vstack([np.zeros((3, 2)), pin.Jexp3(turn)[:, :2]])
    standing = np.zeros((len(E), 6, len(vectors), 3))
    own = np.array([local_twist(s)[:, _STANDS] for s in vectors])
    standing[np.arange(len(E)), :, stations.trial] = own[stations.trial]
    local = np.concatenate(
        [
            np.broadcast_to(local_twist(common.base), (len(E), 6, 6)),
            adjoint(inverse(E @ S_B)) @ twist_tilt,
            adjoint(inverse(T_base_B)) @ standing.reshape(len(E), 6, -1),
            adjoint(inverse(S_B)) @ twist_d,
        ],
        axis=2,
    )
    J_log = np.array([pin.Jlog3(R) for R in error])
    J = np.concatenate([error @ local[:, :3], J_log @ local[:, 3:]], axis=1)
    return np.concatenate([shift, rotation_vector(error)], axis=1), J[:, :, :-3], J[:, :, -3:]


def read_stations(description: Description, trials: Sequence[tuple[Kind, Trial]]) -> Stations:
    """Rests of these spins and drives; a dwell in which the body is not seen is left out.

    Raises:
        NotEnoughData: A trial has fewer than two.
    """
    body, found = description.base_body, []
    for index, (_, trial) in enumerate(trials):
        mine = []
        for start, stop in dwell_windows(trial):
            rows = np.flatnonzero((trial.t_mocap >= start) & (trial.t_mocap <= stop))
            if len(rows) < BLOCKS:
                continue
            poses = mean_poses(body, trial, [rows, *np.array_split(rows, BLOCKS)])
            if np.isfinite(poses.T).all():
                quarters = to_vector(inverse(poses.T[:1]) @ poses.T[1:])
                mine.append((poses.T[0], quarters, poses.covariance[0] / len(rows), index))
        if len(mine) < 2:
            raise NotEnoughData(
                f"{trial.id}: body {body.name!r} is seen in {len(mine)} of {len(trial.dwell_start)} rests; "
                "two are needed: stop between steps of the motion, with the base in sight"
            )
        found += mine
    T, quarters, unit, trial_index = (np.array(x) for x in zip(*found, strict=True))
    unit = unit * description.sigmas.marker**2
    factor = inflation(quarters, unit)
    _log.info("%d rests, noise of their means %.1f times that of independent samples", len(T), np.sqrt(factor))
    kinds, ids = tuple(kind for kind, _ in trials), tuple(trial.id for _, trial in trials)
    return Stations(T, factor * unit, trial_index, kinds, ids)
