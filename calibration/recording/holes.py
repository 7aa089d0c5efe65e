"""Samples an instrument lost: left out of a trial on its own clock, so that no stage reads one.

A row of joint readings with a joint missing has no pose of the hand, a row of the plate's channels with one missing no
wrench: both are left out where they are read, which leaves a hole in their clock (`signals.GAP`). A marker that is not
finite is hidden.
"""

from dataclasses import replace

import numpy as np

from calibration.recording.trial import Trial

_OF_ROBOT = ("t_robot", "q_motor", "q_link", "v_motor", "effort", "q_command", "wrist_wrench")
_OF_PLATE = ("t_plate", "plate_wrench")


def without_holes(trial: Trial) -> Trial:
    """The trial without samples of which a motor-side reading or a channel of the plate is missing; itself if whole."""
    read = np.isfinite(trial.q_motor).all(axis=1)
    felt = np.isfinite(trial.plate_wrench).all(axis=(1, 2))
    hidden = ~np.isfinite(trial.marker_position) & ~np.isnan(trial.marker_position)
    if read.all() and felt.all() and not hidden.any():
        return trial
    kept = {name: getattr(trial, name)[read] for name in _OF_ROBOT} | {n: getattr(trial, n)[felt] for n in _OF_PLATE}
    return replace(trial, **kept, marker_position=np.where(hidden, np.nan, trial.marker_position))
