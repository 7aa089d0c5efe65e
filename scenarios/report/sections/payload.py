"""Rows of the ladder trial by trial, where trials differ by payload or by a push."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from scenarios.report.results.ladder import MEANINGS, Step
from scenarios.report.results.result_files import TrialErrors
from scenarios.report.results.run_results import Results
from scenarios.report.results.section import Drawn, RunView
from scenarios.report.results.traces import PUSH


@dataclass(frozen=True)
class LoadedTrial:
    """A trial and its payload [kg], None where that is not declared; whether it is pushed."""

    trial: str
    payload: float | None
    pushed: bool


@dataclass(frozen=True)
class LoadRow:
    """A row of the ladder over those trials, None where it was not scored."""

    label: str
    errors: tuple[TrialErrors | None, ...]


@dataclass(frozen=True)
class Payload:
    """Errors by payload and push; left out where no trial differs."""

    view: RunView
    title: ClassVar[str] = "Payload and push"
    template: ClassVar[str] = "payload.html"
    folded: ClassVar[bool] = True

    def figures(self) -> Mapping[str, Drawn]:
        """None."""
        return {}

    def context(self) -> Mapping[str, Any] | None:
        """Trials and rows."""
        trials = loaded_trials(self.view.results)
        rows = load_rows(self.view.results, self.view.steps, trials)
        return {"loaded": trials, "load_rows": rows} if rows else None


def loaded_trials(results: Results) -> tuple[LoadedTrial, ...]:
    """Held-out moving trials; none unless they differ in payload or push."""
    description = results.description
    if description is None:
        return ()
    declared = description.payload.mass if description.payload else None
    found = tuple(
        LoadedTrial(e.id, declared if e.payload is None else e.payload, PUSH in e.motion)
        for e in description.trials
        if e.role == "validation" and e.kind != "static"
    )
    return found if len({(t.payload, t.pushed) for t in found}) > 1 else ()


def load_rows(results: Results, steps: Sequence[Step], trials: Sequence[LoadedTrial]) -> tuple[LoadRow, ...]:
    """Predictive rows of the ladder, in its order."""
    errors = {(e.model, e.base, e.encoder, e.trial): e for e in results.evaluation.trials}
    rows = [s for s in steps if s.kind == "predictive" and s.model in MEANINGS]
    found = (LoadRow(s.label, tuple(errors.get((s.model, s.base, s.encoder, t.trial)) for t in trials)) for s in rows)
    return tuple(row for row in found if any(row.errors))
