"""How to make the run and its page again: commands, versions, checksum."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from scenarios.report.results.section import Drawn, RunView


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
