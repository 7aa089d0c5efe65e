"""The tasks of bench-v1: what of a robot's campaign may be calibrated with, what is held out, which row is scored.

geometry   static postures                    held-out postures, base measured
drive      and sweeps of each joint           held-out swings, base measured
base       postures and swings, force plate   held-out swings, base seen in their first second only
all        everything                         as base; then a second session with markers remounted
"""

from dataclasses import dataclass, replace

from calibration import Dataset
from calibration.evaluation import Row
from calibration.recording import TrialEntry

REGISTRATION = "registration"
_MEASURED = ("submitted", "measured")
_PREDICTED = ("submitted", "plate", "dynamics", "fixed")


@dataclass(frozen=True)
class Task:
    """One task.

    Attributes:
        name: Its name.
        kinds: Of the calibration trials it has.
        trials: Which held-out trials are scored.
        base: Whether the base's markers are seen throughout these; else in their first second only.
        sessions: Whether a second session is scored, too.
    """

    name: str
    kinds: tuple[str, ...]
    trials: str
    base: bool
    sessions: bool = False

    def of(self, dataset: Dataset) -> Dataset:
        """The dataset with the trials of this task only."""
        trials = tuple(t for t in dataset.description.trials if self._has(t))
        return replace(dataset, description=dataset.description.model_copy(update={"trials": trials}))

    def _has(self, entry: TrialEntry) -> bool:
        if entry.role == "calibration":
            return entry.kind in self.kinds
        if entry.role == "confirmation":
            return self.sessions
        return (entry.kind == "static") == (self.trials == "static")

    def row(self, rows: tuple[Row, ...], model: str) -> Row | None:
        """The row of a model that is scored: motor encoders, the best source of the base's motion that is allowed."""
        mine = {r.base: r for r in rows if (r.model, r.trials, r.encoder) == (model, self.trials, "motor")}
        return next((mine[b] for b in (_MEASURED if self.base else _PREDICTED) if b in mine), None)


TASKS = (
    Task("geometry", ("static",), "static", True),
    Task("drive", ("static", "sweep"), "dynamic", True),
    Task("base", ("static", "swing"), "dynamic", False),
    Task("all", ("static", "sweep", "swing"), "dynamic", False, True),
)


def held_out(entry: TrialEntry) -> bool:
    """Whether the hand of a trial is to be predicted."""
    return entry.role != "calibration" and entry.motion != REGISTRATION
