"""What a section of the report is, and what it is made from.

To add one: a module and a template beside it in `scenarios/report/sections/`, and its name in `SECTIONS` there.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Protocol

from matplotlib.figure import Figure

from scenarios.report.results.ladder import Step, headline_model, ladder, oracle_base, predictive
from scenarios.report.results.parameters import Known, known
from scenarios.report.results.run_results import Results

Drawn = Figure | Path | None
"""A figure drawn from results, a file of a figure that never changes, or None where data for it are missing."""


@dataclass(frozen=True)
class RunView:
    """A run as its report orders it.

    Attributes:
        results: Content of the run folder.
        ladders: Rows by kind of trial, `dynamic` and `static`, else `all`.
        parameters: What the main model's data fix.
    """

    results: Results
    ladders: Mapping[str, tuple[Step, ...]]
    parameters: tuple[Known, ...]

    @property
    def steps(self) -> tuple[Step, ...]:
        """The rows the report is about: the first kind of trial."""
        return next(iter(self.ladders.values()))

    @property
    def model(self) -> str:
        """The model the report is about."""
        return headline_model(self.results, self.steps)

    @property
    def headline(self) -> Step | None:
        """Its predictive row; with the base measured where nothing predicts without, as of posture means."""
        return predictive(self.steps, self.model) or oracle_base(self.steps, self.model)

    @property
    def has_truth(self) -> bool:
        """Whether a truth is known."""
        return self.results.score is not None


class Section(Protocol):
    """A part of the page, made from a `RunView`; the page numbers its figures and tables and names its files.

    Attributes:
        title: Its heading and its entry in the table of contents; empty: neither.
        template: File name of its template, beside its module.
        folded: Whether it is closed until a reader opens it.
    """

    title: ClassVar[str]
    template: ClassVar[str]
    folded: ClassVar[bool]

    def __init__(self, view: RunView) -> None: ...

    def figures(self) -> Mapping[str, Drawn]:
        """Every figure it can have, by the name of its file."""
        ...

    def context(self) -> Mapping[str, Any] | None:
        """What its template shows beside `view` and `results`; None: the section is left out."""
        ...


def run_view(results: Results) -> RunView:
    """Order the content of a run folder."""
    ladders = {trials: ladder(results, trials) for trials in ("dynamic", "static")}
    ladders = {trials: steps for trials, steps in ladders.items() if steps} or {"all": ladder(results, "all")}
    return RunView(results, ladders, known(results))
