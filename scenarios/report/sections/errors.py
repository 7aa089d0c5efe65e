"""Errors of all rows as boxplots and along each axis, and over the time of one trial."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from scenarios.report.results import figures
from scenarios.report.results.ladder import readable
from scenarios.report.results.section import Drawn, RunView


@dataclass(frozen=True)
class HeldOutErrors:
    """Distributions and time series of the errors; left out where no errors over time were saved."""

    view: RunView
    title: ClassVar[str] = "Errors: distribution, axes, time"
    template: ClassVar[str] = "errors.html"
    folded: ClassVar[bool] = True

    def figures(self) -> Mapping[str, Drawn]:
        """Boxplot of every row, and the traces of one trial."""
        results, steps = self.view.results, self.view.steps
        return {"errors": figures.boxes(results, readable(steps)), "traces": figures.traces(results, steps)}

    def context(self) -> Mapping[str, Any] | None:
        """The trial drawn over time, or by posture."""
        results = self.view.results
        trial = figures.traced_trial(results, self.view.steps)
        return None if trial is None else {"trial": trial, "means": figures.of_means(results, trial)}
