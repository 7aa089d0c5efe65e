"""What each stage of the calibration reported, and how to make the run again."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from scenarios.report.results.section import Drawn, RunView


@dataclass(frozen=True)
class Stages:
    """The messages of the stages, good ones among them."""

    view: RunView
    title: ClassVar[str] = "Messages of the stages"
    template: ClassVar[str] = "stages.html"
    folded: ClassVar[bool] = True

    def figures(self) -> Mapping[str, Drawn]:
        """None."""
        return {}

    def context(self) -> Mapping[str, Any] | None:
        """The messages."""
        estimate = self.view.results.estimate
        return {"verdicts": estimate.verdicts} if estimate and estimate.verdicts else None


@dataclass(frozen=True)
class Reproduce:
    """Commands, versions and the checksum of the dataset."""

    view: RunView
    title: ClassVar[str] = "Reproduce"
    template: ClassVar[str] = "reproduce.html"
    folded: ClassVar[bool] = True

    def figures(self) -> Mapping[str, Drawn]:
        """None."""
        return {}

    def context(self) -> Mapping[str, Any]:
        """The scenario's name and versions."""
        return {"scenario": self.view.results.scenario}
