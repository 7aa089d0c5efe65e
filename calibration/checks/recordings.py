"""Recordings that cannot be true, judged before anything is written or fitted.

Units show in sizes: a body of markers over its nominal distances, a reading over its joint's limits, the plate's load
over the robot's weight.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from calibration.checks.joint_readings import implausible_readings, missing_readings, wrong_sides
from calibration.checks.marker_bodies import implausible_markers, not_rigid, wrong_scale
from calibration.checks.plates import implausible_plates
from calibration.errors import InputError
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain


def check(file: str, trial: Trial | PostureMeans, description: Description, chain: Chain, mass: float) -> None:
    """Reject a trial that cannot be true.

    Args:
        file: Where the trial came from, for the message.
        trial: What is to be written.
        description: Of the dataset it is to be written in.
        chain: The nominal chain.
        mass: Of the nominal robot [kg].

    Raises:
        InputError: With everything that was found.
    """
    found = [*implausible_markers(trial, description), *missing_readings(trial)]
    found += [] if found else [*implausible_inputs(description, chain, (trial,))]
    found += [] if found else [*not_rigid(trial, description)]
    if isinstance(trial, Trial):
        weight = mass * float(np.linalg.norm(description.gravity))
        found += [*wrong_sides(trial), *_clocks(trial), *implausible_plates(trial, weight)]
    if found:
        raise InputError(file, "; ".join(found))


def implausible_inputs(description: Description, chain: Chain, trials: Sequence[Trial | PostureMeans]) -> Iterator[str]:
    """Why the recordings of these trials cannot be used, each finding once."""
    yield from wrong_scale(description, trials)
    yield from implausible_readings(chain, np.concatenate([trial.q_motor for trial in trials]))


def _clocks(trial: Trial) -> Iterator[str]:
    for name in ("t_robot", "t_mocap", "t_plate"):
        t = getattr(trial, name)
        back = np.flatnonzero(~(np.diff(t) > 0.0))
        if len(back):
            k = int(back[0])
            yield f"{name} does not increase at sample {k + 1} ({t[k]:.6f} s, then {t[k + 1]:.6f} s); sort it"
