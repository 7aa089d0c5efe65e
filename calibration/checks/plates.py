"""Force-plate readings that cannot be true: missing samples, a sign or scale that is not the robot's weight."""

from collections.abc import Iterator

import numpy as np

from calibration.recording.trial import Trial

_LOAD = 3.0  # believable ratio of the plates' load to the robot's weight, or its inverse


def implausible_plates(trial: Trial, weight: float) -> Iterator[str]:
    """Why the plates of a trial cannot be used; `weight` of the nominal robot [N]."""
    bad = np.flatnonzero(~np.isfinite(trial.plate_wrench).all(axis=(1, 2)))
    if len(bad):
        yield f"plate: {len(bad)} samples are missing, the first is {bad[0]}; cut them out, or leave the plate out"
    if not len(trial.t_plate):
        return
    load = -float(np.median(trial.plate_wrench[:, :, 2].sum(axis=1)))
    if load < 0.0:
        yield (
            f"plate: Fz is {-load:+.0f} N on a robot that weighs {weight:.0f} N: its wrench is the reaction, or the "
            "plate is upside down; see convention and axes"
        )
    elif not weight / _LOAD < load < weight * _LOAD:
        yield f"plate carries {load:.3g} N, the nominal robot weighs {weight:.0f} N; see the plate's units and labels"
