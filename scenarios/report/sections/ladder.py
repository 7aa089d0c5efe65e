"""The ladder: one predictive row a model first; oracles and errors against the truth folded behind."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from scenarios.report.results.ladder import MEANINGS, best_of_each
from scenarios.report.results.section import Drawn, RunView

_CLAIM = (
    "All figures are of a simulated robot with known parameters. Rows are predictive unless they say oracle, and no "
    "bias is removed. The published figures (Nguyen et al. 2024) are of a real robot, evaluated by public code with "
    "the measured base, link encoders, and constants removed per axis. Do not compare the two without these caveats."
)
_CLAIM_REAL = (
    "No truth is known here: errors are against the motion capture and include its noise. Rows are predictive unless "
    "they say oracle, and no bias is removed. The published figures (Nguyen et al. 2024) were evaluated by public code "
    "with the measured base, link encoders, and constants removed per axis."
)
_CONVENTIONS = (
    "Per component is the square root of the mean of all squared components, as published; norm is the root mean "
    "square distance, √3 times larger. Orientation is the angle of the rotation between predicted and measured hand."
)


@dataclass(frozen=True)
class Ladder:
    """Held-out error of every row."""

    view: RunView
    title: ClassVar[str] = "Error on unseen trials, model by model"
    template: ClassVar[str] = "ladder.html"
    folded: ClassVar[bool] = False

    def figures(self) -> Mapping[str, Drawn]:
        """None."""
        return {}

    def context(self) -> Mapping[str, Any]:
        """The rows and what they mean."""
        steps = self.view.steps
        return {
            "claim": _CLAIM if self.view.has_truth else _CLAIM_REAL,
            "conventions": _CONVENTIONS,
            "first": best_of_each(steps),
            "meanings": {m: text for m, text in MEANINGS.items() if any(s.model == m for s in steps)},
        }
