"""Estimated parameters beside their truth or their nominal value: figures, then the whole table."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from scenarios.report.results import figures
from scenarios.report.results.parameters import coverage, groups, left_out
from scenarios.report.results.section import Drawn, RunView


@dataclass(frozen=True)
class Parameters:
    """What the data identify; left out where they identify nothing."""

    view: RunView
    title: ClassVar[str] = "Parameters"
    template: ClassVar[str] = "parameters.html"
    folded: ClassVar[bool] = True

    def figures(self) -> Mapping[str, Drawn]:
        """Intervals of all, and the distribution of their errors."""
        found, truth = self.view.parameters, self.view.has_truth
        return {"parameters": figures.forest(found, truth), "z_scores": figures.z_scores(found, truth)}

    def context(self) -> Mapping[str, Any] | None:
        """Parameters by kind, coverage, and how many are not identified."""
        if not self.view.parameters:
            return None
        return {
            "known": groups(self.view.parameters),
            "coverage": coverage(self.view.parameters),
            "left_out": left_out(self.view.results.score, self.view.results.estimate),
        }
