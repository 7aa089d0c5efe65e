"""What was recorded: instruments, trials, clocks, and a picture of the robot."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from scenarios.report.results.recordings import instruments
from scenarios.report.results.section import Drawn, RunView


@dataclass(frozen=True)
class Recordings:
    """Instruments, trials and clocks; left out without the dataset."""

    view: RunView
    title: ClassVar[str] = "Recordings"
    template: ClassVar[str] = "recordings.html"
    folded: ClassVar[bool] = True

    def figures(self) -> Mapping[str, Drawn]:
        """None that is drawn here."""
        return {}

    def context(self) -> Mapping[str, Any] | None:
        """Instruments in words; the trials are in the results."""
        results = self.view.results
        if results.description is None and results.picture is None:
            return None
        return {"instruments": instruments(results.description, results.recorded) if results.description else {}}
