"""Recordings that cannot be true, judged before anything is written or fitted, alike for every role.

Units show in sizes: a body of markers over its nominal distances, a reading over its joint's limits, the plate's load
over the robot's weight. A finding of some trials names them.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from calibration.checks.joint_readings import commanded, implausible_readings, missing_readings, wrong_sides
from calibration.checks.marker_bodies import implausible_markers, not_rigid, wrong_scale
from calibration.checks.marker_shapes import STAGE, wrong_shapes
from calibration.checks.plates import implausible_plates
from calibration.checks.trial_times import holes, wrong_dwells
from calibration.errors import InputError
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain
from calibration.robot.laboratory import Laboratory
from calibration.verdict import Verdict


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
    found += [] if found else [*_implausible(description, chain, (trial,))]
    found += [] if found else [*not_rigid(trial, description)]
    if isinstance(trial, Trial):
        weight = mass * float(np.linalg.norm(description.gravity))
        found += [*wrong_sides(trial), *commanded(trial, description.sigmas.encoder)]
        found += [*_clocks(trial), *implausible_plates(trial, weight)]
    if found:
        raise InputError(file, "; ".join(found))


def judged(lab: Laboratory, trials: Sequence[Trial | PostureMeans], calibrated: bool = False) -> tuple[Verdict, ...]:
    """What is wrong with recordings of one role, all findings of units first: the others mean nothing without them.

    `calibrated` recordings are judged by a calibration's own stages as well: plates and link readings.
    """
    refused = tuple(Verdict(STAGE, "refused", message) for message in _named(lab, trials))
    if refused:
        return refused
    continuous = [MeasuredTrial.of(lab.description, t) for t in trials if isinstance(t, Trial)]
    found = [*wrong_shapes(lab, trials), *wrong_dwells(continuous), *holes(continuous)]
    for trial in continuous:
        wrong = [*commanded(trial, lab.description.sigmas.encoder)]
        if not calibrated:
            weight = float(sum(i.mass for i in lab.floating.inertias) * np.linalg.norm(lab.description.gravity))
            wrong += [*wrong_sides(trial), *implausible_plates(trial, weight)]
        found += [Verdict(STAGE, "refused", f"{trial.id}: {message}") for message in wrong]
    return tuple(found)


def _named(lab: Laboratory, trials: Sequence[Trial | PostureMeans]) -> Iterator[str]:
    """What `_implausible` says of all trials, or of those that are so."""
    found = {t.id: list(_implausible(lab.description, lab.chain, (t,))) for t in trials}
    if all(found.values()):
        yield from _implausible(lab.description, lab.chain, trials)
        return
    for name, messages in found.items():
        yield from (f"{name}: {message}" for message in messages)


def _implausible(description: Description, chain: Chain, trials: Sequence[Trial | PostureMeans]) -> Iterator[str]:
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
