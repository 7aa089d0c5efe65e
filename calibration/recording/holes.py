"""Samples an instrument lost: left out of a trial on its own clock, so that no stage reads one.

A joint whose motor side is missing while its link encoder reads is where the link is,

    q_motor = q_link + d(t),    d motor minus link reading where both are known, linear between

and that link reading is taken out: neither says what the other does, so that joint's models lose the time, and no other
joint's. Without a link encoder nothing shows where the joint is, nor the pose of the hand or the torque of any joint:
the row of readings is left out, as is a row of the plate's channels with one missing, which leaves a hole in their
clock (`signals.GAP`). A marker that is not finite is hidden.
"""

from dataclasses import replace

import numpy as np

from calibration.recording.trial import Trial

_OF_ROBOT = ("t_robot", "q_motor", "q_link", "v_motor", "effort", "q_command", "wrist_wrench")
_OF_PLATE = ("t_plate", "plate_wrench")


def without_holes(trial: Trial) -> Trial:
    """The trial without samples that miss a joint's position or a channel of the plate; itself if whole."""
    trial = _by_links(trial)
    read = np.isfinite(trial.q_motor).all(axis=1)
    pressed = np.isfinite(trial.plate_wrench).all(axis=(1, 2))
    hidden = ~np.isfinite(trial.marker_position) & ~np.isnan(trial.marker_position)
    if read.all() and pressed.all() and not hidden.any():
        return trial
    kept = {name: getattr(trial, name)[read] for name in _OF_ROBOT} | {n: getattr(trial, n)[pressed] for n in _OF_PLATE}
    return replace(trial, **kept, marker_position=np.where(hidden, np.nan, trial.marker_position))


def _by_links(trial: Trial) -> Trial:
    """The trial with link readings in place of the motor readings that are missing."""
    replaced = ~np.isfinite(trial.q_motor) & np.isfinite(trial.q_link)
    d = trial.q_motor - trial.q_link
    joints = [j for j in np.flatnonzero(replaced.any(axis=0)) if np.isfinite(d[:, j]).any()]
    if not joints:
        return trial
    q, link = trial.q_motor.copy(), trial.q_link.copy()
    for j in joints:
        rows, known = replaced[:, j], np.isfinite(d[:, j])
        q[rows, j] = link[rows, j] + np.interp(trial.t_robot[rows], trial.t_robot[known], d[known, j])
        link[rows, j] = np.nan
    return replace(trial, q_motor=q, q_link=link)
