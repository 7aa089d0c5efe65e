"""Recordings that cannot be true, judged before anything is written or fitted, alike for every role.

Units show in sizes: a body of markers over its nominal distances, a reading over its joint's limits, the plate's load
over the robot's weight. Times show in dwells in which the arm moves, holes, one recording listed twice. A finding of
some trials names them.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from calibration.checks.joint_readings import commanded, exchanged, implausible_readings, missing_readings, wrong_sides
from calibration.checks.marker_bodies import implausible_markers, not_rigid, wrong_scale
from calibration.checks.marker_shapes import STAGE, wrong_shapes
from calibration.checks.plates import implausible_plates, saturated
from calibration.errors import InputError
from calibration.mocap.dwells import rests
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Description, TrialEntry
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain
from calibration.robot.laboratory import Laboratory
from calibration.verdict import Verdict

_MANY = 0.25  # share of moving dwells beyond which all of them are doubtful
_LONG = 0.5  # [s] a shorter hole is a log's usual drop-out
_CLOCKS = (("t_robot", "joint readings"), ("t_plate", "readings of the plate"), ("t_mocap", "frames"))


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
        sigma = description.sigmas.encoder
        found += [*wrong_sides(trial), *commanded(trial, sigma), *exchanged(trial, sigma)]
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
        found += [Verdict(STAGE, "warning", f"{trial.id}: {message}") for message in saturated(trial)]
        sigma = lab.description.sigmas.encoder
        wrong = [*commanded(trial, sigma), *exchanged(trial, sigma)]
        if not calibrated:
            wrong += [*wrong_sides(trial), *implausible_plates(trial, _weight(lab))]
        found += [Verdict(STAGE, "refused", f"{trial.id}: {message}") for message in wrong]
    return tuple(found)


def unused_plates(lab: Laboratory, trials: Sequence[Trial]) -> Iterator[Verdict]:
    """What is wrong with plates on no known clock, which no stage judges."""
    for trial in trials:
        for message in implausible_plates(trial, _weight(lab)):
            yield Verdict(STAGE, "warning", f"{trial.id}: {message}")


def _weight(lab: Laboratory) -> float:
    """Of the nominal robot [N]."""
    return float(sum(i.mass for i in lab.floating.inertias) * np.linalg.norm(lab.description.gravity))


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


def wrong_dwells(trials: Sequence[MeasuredTrial]) -> Iterator[Verdict]:
    """Dwells in which the hand does not rest: they are not used."""
    n, found = sum(len(t.dwell_start) for t in trials), []
    for trial in trials:
        found += [f"{trial.id} {k}" for k in np.flatnonzero(~rests(trial))]
    if not found:
        return
    many = len(found) > _MANY * n
    remedy = "they must be [start, stop] on the motion capture's clock" if many else "they are left out"
    message = f"the hand moves in {len(found)} of {n} dwells, counted from 0: {', '.join(found[:8])}"
    yield Verdict(STAGE, "refused" if many else "warning", f"{message}{', ...' if found[8:] else ''}; {remedy}")


def holes(trials: Sequence[MeasuredTrial]) -> Iterator[Verdict]:
    """Trials in which an instrument, or one joint's encoder, lost samples."""
    for trial in trials:
        for name, what in _CLOCKS:
            yield from _hole(trial.id, what, getattr(trial, name), "what was lost is not used")
        for name, read in zip(trial.joint, np.isfinite(trial.q_link).T, strict=True):
            if read.any() and not read.all():
                t = np.unique([trial.t_robot[0], *trial.t_robot[read], trial.t_robot[-1]])
                yield from _hole(trial.id, f"joint readings of {name}", t, "its joint models lose that time")


def _hole(trial: str, what: str, t: np.ndarray, cost: str) -> Iterator[Verdict]:
    """Samples at t (n,) [s] that are too far apart."""
    steps = np.diff(t)
    long = np.flatnonzero(steps > _LONG)
    if len(long):
        k = int(long[np.argmax(steps[long])])
        message = f"{trial}: {len(long)} holes in the {what}, the longest {steps[k]:.2f} s after {t[k]:.2f} s"
        yield Verdict(STAGE, "warning", f"{message} of their clock; {cost}")


def listed_twice(entries: Sequence[TrialEntry]) -> Iterator[str]:
    """Trials whose files are the same."""
    first: dict[str, TrialEntry] = {}
    for entry in entries:
        other = first.setdefault(entry.sha256, entry)
        if other is not entry:
            yield (
                f"trials {other.id!r} ({other.role}) and {entry.id!r} ({entry.role}) are one recording: an error on it "
                "is no error on unseen motion; list it once"
            )
