"""The first screen of a fit without held-out trials: what may be used, its error at left-out postures, what is next."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from scenarios.report.results.section import Drawn, RunView

_WORST = ("refused", "warning", "missing", "ok")


@dataclass(frozen=True)
class Fitted:
    """Badge, cross-validated error, a line a stage."""

    view: RunView
    title: ClassVar[str] = ""
    template: ClassVar[str] = "fitted.html"
    folded: ClassVar[bool] = False

    def figures(self) -> Mapping[str, Drawn]:
        """None."""
        return {}

    def context(self) -> Mapping[str, Any] | None:
        """What the stages reported, the worst of each."""
        estimate = self.view.results.estimate
        if estimate is None:
            return None
        stages: dict[str, str] = {}
        for v in estimate.verdicts:
            stages[v.stage] = min(stages.get(v.stage, "ok"), v.verdict, key=_WORST.index)
        errors = [v.message for v in estimate.verdicts if "left-out" in v.message]
        return {"extent": estimate.extent, "errors": errors, "stages": stages, "verdicts": estimate.verdicts}
