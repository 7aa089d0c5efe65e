"""Times of trials that cannot be what is declared: dwells in which the arm moves, holes, one recording listed twice."""

from collections.abc import Iterator, Sequence

import numpy as np

from calibration.mocap.dwells import rests
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.recording.schema import TrialEntry
from calibration.verdict import Verdict

STAGE = "reading"
_MANY = 0.25  # share of moving dwells beyond which all of them are doubtful
_LONG = 0.5  # [s] a shorter hole is a log's usual drop-out
_CLOCKS = (("t_robot", "joint readings"), ("t_plate", "readings of the plate"), ("t_mocap", "frames"))


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
