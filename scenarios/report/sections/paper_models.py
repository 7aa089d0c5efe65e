"""The paper's four models as predictions, and one estimate under its protocol and under ours."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from matplotlib.figure import Figure

from scenarios.report.results import figures
from scenarios.report.results.published import MODELS, add_medians, add_orientation, paper_steps
from scenarios.report.results.section import Drawn, RunView


@dataclass(frozen=True)
class PaperModels:
    """Boxplots of nominal and model_1 to model_3, protocols, comparisons."""

    view: RunView
    title: ClassVar[str] = "The paper's four models"
    template: ClassVar[str] = "paper_models.html"
    folded: ClassVar[bool] = True

    def figures(self) -> Mapping[str, Drawn]:
        """The paper's boxplot, None unless all four models are there."""
        return {"paper": self._boxes()}

    def context(self) -> Mapping[str, Any] | None:
        """Protocols and comparisons."""
        evaluation = self.view.results.evaluation
        found = {"protocols": evaluation.protocols, "comparisons": evaluation.comparisons}
        return found if any(found.values()) or len(paper_steps(self.view.steps)) == len(MODELS) else None

    def _boxes(self) -> Figure | None:
        rows = paper_steps(self.view.steps)
        drawn = figures.boxes(self.view.results, rows) if len(rows) == len(MODELS) else None
        if drawn is not None:
            for axis, ax in enumerate(drawn.axes[:3]):
                add_medians(rows, axis, ax)
            figures.share_limits(drawn.axes[:3])
            add_orientation(rows, drawn.axes[4])
        return drawn
