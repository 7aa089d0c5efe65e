"""The frames of Heins 2022, where an estimate has them."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from scenarios.report.results.section import Drawn, RunView

_DIAGRAM = Path(__file__).parents[1] / "frame_chain.svg"


@dataclass(frozen=True)
class Frames:
    """A diagram of the frames with our parameter names."""

    view: RunView
    title: ClassVar[str] = "Frames of Heins 2022"
    template: ClassVar[str] = "frames.html"
    folded: ClassVar[bool] = True

    def figures(self) -> Mapping[str, Drawn]:
        """The diagram."""
        return {"frames": _DIAGRAM if self._is_there else None}

    def context(self) -> Mapping[str, Any] | None:
        """Nothing beside the diagram."""
        return {} if self._is_there else None

    @property
    def _is_there(self) -> bool:
        estimate = self.view.results.estimate
        return estimate is not None and any(m.name in ("base_frame", "arm_tool") for m in estimate.models)
