"""Rests of spins and drives: where the base's marker body stood, with covariance, in the order they were made.

Means over each dwell, as in `postures`; the local twist of a mean has covariance S = f C_B sigma^2 / n.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.errors import NotEnoughData
from calibration.markers import base_body
from calibration.postures import BLOCKS, dwell_windows, inflation, mean_poses
from calibration.recording import Trial
from calibration.schema import Description, Kind
from calibration.se3 import inverse, to_vector

MOVES: tuple[Kind, ...] = ("spin", "drive")
_log = logging.getLogger(__name__)


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


def read_stations(description: Description, trials: Sequence[tuple[Kind, Trial]]) -> Stations:
    """Rests of these spins and drives; a dwell in which the body is not seen is left out.

    Raises:
        NotEnoughData: A trial has fewer than two.
    """
    body, found = base_body(description), []
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
