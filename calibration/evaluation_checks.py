"""What is to be said of an evaluation: trials whose errors are not the model's, rows worse than those they build on.

A base that was pushed, rolled or lifted while a trial was recorded: no prediction is told, and those that do not
measure the base keep the place it had in the first second.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from calibration.base_motion import MOVES
from calibration.bodies import poses_of
from calibration.comparison import Comparison
from calibration.markers import base_body
from calibration.recording import Trial
from calibration.schema import Description, TrialEntry
from calibration.se3 import inverse, mean, to_vector
from calibration.suspension_checks import moved_by
from calibration.suspension_rest import REST
from calibration.verdict import Verdict

STAGE = "evaluation"


def moved_in_trials(description: Description, pairs: Iterable[tuple[TrialEntry, Trial]]) -> Iterator[Verdict]:
    """A warning that names the trials after which the base stands elsewhere; none where it is meant to move."""
    found = {entry.id: _moved(description, trial) for entry, trial in pairs if entry.kind not in MOVES}
    told = ", ".join(f"{name} by {how}" for name, how in found.items() if how)
    if told:
        message = f"base moved during {told}: their errors with the base not measured are not the model's"
        yield Verdict(STAGE, "warning", message)


def no_better(compared: Iterable[Comparison]) -> Iterator[Verdict]:
    """A warning for each row that is worse than the one it builds on, and why where that is known."""
    for c in compared:
        if c.finding == "worse":
            message = f"{c.b[0]} ({c.b[1]}) is worse than {c.a[0]} by {c.difference_mm:.2f} mm"
            yield Verdict(STAGE, "warning", message + (f": {c.reason}" if c.reason else ""))


def _moved(description: Description, trial: Trial) -> str:
    T, t = poses_of(base_body(description), trial).T, trial.t_mocap
    seen = np.isfinite(T).all(axis=(1, 2))
    before, after = seen & (t <= t[0] + REST), seen & (t >= t[-1] - REST)
    if not before.any() or not after.any():
        return ""
    return moved_by(to_vector(inverse(mean(T[before])) @ mean(T[after])))
