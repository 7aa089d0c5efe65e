"""What a recording shows of a base on its wheels: the wrench on the floor, and the displacement that went with it.

Both in frame 0 (`calibration.suspension_rest`), about its origin. The wrench is low-passed at 20 Hz, since what slips
slips in peaks, the displacement at 10 Hz. At rest a robot pulls the floor neither sideways nor about the vertical: what
a plate reads there of these is its offset.

Markers do not keep their shape (`calibration.shape_change`). What of it is a motion of the body cannot be seen; it is
sampled as large as what can, d(t), at the same times, in directions of its own (`Recorded.shifting`):

    e(t) = G d(t) / sqrt(3 m - 6)      G (3 m, 3 m) ~ N(0, 1):  each coordinate's variance is |d|^2 / (3 m - 6)
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from calibration.errors import NotEnoughData
from calibration.mocap import body_poses, free, relabelled_trial, shape_change
from calibration.numerics.signals import CUTOFF, Signal, low_passed
from calibration.recording import Clock, Dataset, Description, Trial
from calibration.stages.suspension import Rest, base_response_of, plate_load, rest_of

REST = slice(100, 150)
"""Samples of a trial's rest that displacements are taken from: of the log's second second, since its markers step by
0.3 mrad within the first while the plate measures nothing."""

_WRENCH = 20.0  # [Hz]
_LEVEL = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 0.0])  # what of a resting wrench a floor can feel


@dataclass(frozen=True)
class Recorded:
    """One trial.

    Attributes:
        trial_id: The trial.
        t: (n,) [s], from 0, spacing 0.01 s.
        rest: (6,) wrench on the floor at rest [N, N.m, frame 0].
        w: (n, 6) its change since.
        x: (n, 6) displacement since rest [m, rad, frame 0].
        markers: (m, 3) of the base [m].
        frame: Frame 0.
        change: (n, 3 m) of the markers' shape since rest [m, body].
    """

    trial_id: str
    t: np.ndarray
    rest: np.ndarray
    w: np.ndarray
    x: np.ndarray
    markers: np.ndarray
    frame: Rest
    change: np.ndarray

    def shifting(self, rng: np.random.Generator) -> np.ndarray:
        """Errors of markers (n, m, 3) [m, body] as large as their shape changes, when it does, in other directions."""
        G = rng.normal(size=2 * (self.markers.size,)) / np.sqrt(free(len(self.markers)))
        return (self.change @ G.T).reshape(-1, *self.markers.shape)

    def seen(
        self, x: np.ndarray, noise: float, rng: np.random.Generator, shift: np.ndarray | float = 0.0
    ) -> np.ndarray:
        """What motion capture would make (n, 6) of a displacement (n, 6).

        Args:
            x: (n, 6) displacement [m, rad, frame 0].
            noise: White, on each marker [m].
            rng: Of the noise.
            shift: (n, m, 3) of the markers [m, body].
        """
        T = self.frame.poses(x)
        places = np.broadcast_to(self.markers + shift, (len(x), *self.markers.shape))
        positions = np.einsum("nij,nmj->nmi", T[:, :3, :3], places) + T[:, None, :3, 3]
        positions += noise * rng.normal(size=positions.shape)
        return referred(smooth(self.t, self.frame.displacement(body_poses(self.markers, positions).T)))


def smooth(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """x (n, 6) without what is faster than a displacement is compared at."""
    return low_passed(Signal(t, x, np.ones(len(t), dtype=bool)), CUTOFF).x


def referred(x: np.ndarray) -> np.ndarray:
    """Displacement (n, 6) since rest."""
    return np.asarray(x - x[REST].mean(axis=0))


def recorded(dataset: Dataset) -> tuple[Recorded, ...]:
    """The moving trials of a dataset, whose plate must be on the clock of its markers.

    Raises:
        NotEnoughData: None shows the base's markers and a plate.
    """
    trials = [
        relabelled_trial(dataset, e)
        for e in dataset.description.trials
        if e.kind != "static" and not dataset.has_means(e)
    ]
    found = tuple(_trial(dataset.description, trial) for trial in trials if len(trial.t_plate))
    if not found:
        raise NotEnoughData("no trial of the dataset has base markers and a plate; record both while the arm moves")
    return found


def _trial(description: Description, trial: Trial) -> Recorded:
    same = Clock("plate", 0.0, 0.0, np.zeros((2, 2)), 0.0, 0.0)
    rest = rest_of(description, trial, np.eye(4))
    response = base_response_of(description, trial, rest, plate_load(trial, same, rest.T_lab_0, _WRENCH))
    body, forcing = description.base_body, response.forcing
    shape = shape_change(body, trial)
    change = referred(CubicSpline(shape.t, shape.x)(forcing.t))
    markers = np.array([m.xyz for m in body.markers if m.name in trial.marker])
    t = forcing.t - forcing.t[0]
    return Recorded(trial.id, t, _LEVEL * forcing.rest, forcing.w, referred(response.x), markers, rest, change)
