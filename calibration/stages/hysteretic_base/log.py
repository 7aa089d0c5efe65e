"""A log of base markers and plate, without gaps: its trials one after the other.

    x (n, 6) displacement of the base since the first second, w (n, 6) change of the wrench, both in frame 0

w is low-passed at 20 Hz, since what slips slips in peaks; motions are compared below 5 Hz, where markers show them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from calibration.errors import NotEnoughData
from calibration.numerics.signals import GAP, Signal, low_passed
from calibration.recording.clock import shared_clock
from calibration.recording.trial import Trial
from calibration.robot.laboratory import Laboratory
from calibration.stages.suspension import base_response_of, plate_load, rest_of

WRENCH, COMPARED = 20.0, 5.0  # [Hz]
SETTLED = 1.0  # [s] at the start: the reference of all displacements


@dataclass(frozen=True)
class BaseLog:
    """A log on an even grid, n samples.

    Attributes:
        t: (n,) [s] since its start.
        w: (n, 6) change of the wrench on the floor [N, N.m, frame 0].
        x: (n, 6) displacement of the base [m, rad, frame 0].
    """

    t: np.ndarray
    w: np.ndarray
    x: np.ndarray

    @cached_property
    def slow_w(self) -> np.ndarray:
        """(n, 6) the wrench as motions are compared."""
        return compared(self.w)


def log_of(lab: Laboratory, trials: Sequence[Trial]) -> BaseLog:
    """The log of trials whose plate is sampled with the markers, in the order of time.

    Raises:
        NotEnoughData: There is a hole between two of them, or one has no plate.
    """
    if not trials:
        raise NotEnoughData("no trial of the dataset moves")
    trials = sorted(trials, key=lambda trial: float(trial.t_mocap[0]))
    whole = _joined(trials)
    if not len(whole.t_plate):
        raise NotEnoughData(f"{whole.id}: no force plate; the base's motion is predicted from its wrench")
    rest = rest_of(lab.description, whole, lab.T_base_B)
    load = plate_load(whole, shared_clock("plate"), rest.T_lab_0, WRENCH)
    response = base_response_of(lab.description, whole, rest, load)
    return BaseLog(response.forcing.t - response.forcing.t[0], response.forcing.w, compared(response.x))


def compared(x: np.ndarray) -> np.ndarray:
    """Columns (n, c) on the log's grid without what is faster than motions are compared at; zero phase."""
    return low_passed(Signal(np.zeros(len(x)), x, np.ones(len(x), dtype=bool)), COMPARED).x


def _joined(trials: Sequence[Trial]) -> Trial:
    for before, after in pairwise(trials):
        if not 0.0 < (hole := float(after.t_mocap[0] - before.t_mocap[-1])) <= GAP:
            raise NotEnoughData(f"{hole:.2f} s between {before.id} and {after.id}: a log must be without gaps")
    t, marker_position, t_plate, plate_wrench = (
        np.concatenate([getattr(trial, name) for trial in trials])
        for name in ("t_mocap", "marker_position", "t_plate", "plate_wrench")
    )
    return replace(trials[0], t_mocap=t, marker_position=marker_position, t_plate=t_plate, plate_wrench=plate_wrench)
