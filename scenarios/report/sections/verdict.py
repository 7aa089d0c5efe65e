"""The first screen: calibrated or not, the error on unseen motion, what it consists of, and what to do next.

Of a fit without held-out trials: what may be used, its error at left-out postures, what is next.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from calibration.prediction import BASELINE
from scenarios.report.results import figures, headline
from scenarios.report.results.formatting import significant
from scenarios.report.results.headline import Notice
from scenarios.report.results.ladder import best_of_each, floor, oracle_base, predictive
from scenarios.report.results.parameters import coverage
from scenarios.report.results.section import Drawn, RunView

_WORST = ("refused", "warning", "missing", "ok")
_MIN_COVERAGE = 0.85  # [-] below which 95 % intervals are called too narrow


@dataclass(frozen=True)
class Verdict:
    """Badge, sentence, boxplot, next steps; the findings of the stages folded."""

    view: RunView
    title: ClassVar[str] = ""
    template: ClassVar[str] = "verdict.html"
    folded: ClassVar[bool] = False

    def figures(self) -> Mapping[str, Drawn]:
        """The predictive rows beside the published medians."""
        return {"headline": figures.overview(self.view.results, best_of_each(self.view.steps))}

    def context(self) -> Mapping[str, Any]:
        """The headline of the run."""
        found = headline.headline(self.view.results, self.view.steps)
        return {
            "headline": found,
            "sentences": tuple(self._sentences()),
            "notices": (*found.notices, *self._too_narrow()),
            "coverage": coverage(self.view.parameters),
        }

    def _sentences(self) -> Iterator[str]:
        """What the headline is to be compared with."""
        steps, best = self.view.steps, self.view.headline
        if best is None:
            return
        baseline, oracle = predictive(steps, BASELINE), oracle_base(steps, best.model)
        if baseline is not None and best.model != BASELINE:
            yield f"Fitting the marker frames alone (registration): {headline.figures(baseline.main)}."
        if oracle is not None and oracle is not best:
            yield f"{best.model} with the measured base (an oracle): {headline.figures(oracle.main)}."
        if best.truth is not None:
            skill = "" if best.truth.skill is None else f", skill {significant(best.truth.skill, 2)}"
            lowest = floor(steps)
            under = "" if lowest is None else f"; floor {headline.figures(lowest)}"
            yield f"Against the true hand pose: {headline.figures(best.truth)}{skill}{under}."

    def _too_narrow(self) -> Iterator[Notice]:
        covered, judged = coverage(self.view.parameters)
        if self.view.has_truth and covered < _MIN_COVERAGE * judged:
            message = (
                f"the 95 % intervals are too narrow, {covered} of {judged} contain the truth: effects that the model "
                "leaves out are not in the standard deviations. Rely on the prediction errors, which are measured, "
                "rather than on single parameters"
            )
            yield Notice("warning", "uncertainty", message)


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
        found = [Notice(v.verdict, v.stage, v.message) for v in estimate.verdicts]
        asked = [
            n for n in found if n.level == "refused" or "record_next" in n.message or "to record next" in n.message
        ]
        return {
            "extent": estimate.extent,
            "errors": errors,
            "stages": stages,
            "asked": [f"{n.stage}: {n.message.removeprefix('to record next: ')}" for n in asked],
            "missing": [step.text for step in headline.to_record(found)],
        }
