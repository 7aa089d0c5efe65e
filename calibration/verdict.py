"""A finding of a stage, kept with the estimate."""

from dataclasses import dataclass
from typing import Literal

Direction = tuple[tuple[str, float], ...]
"""Parameters by name, and how far one cause may have moved them together: a standard deviation each [their unit]."""


@dataclass(frozen=True)
class Verdict:
    """What a stage has to say.

    Attributes:
        stage: Name of the stage.
        verdict: `ok`; `warning`, usable with care; `missing`, data for it were not there; `refused`, must not be used.
        message: What was found and what to do.
        moves: What its cause may have moved; intervals of an estimate that is not refused include it, see
            `inference.parameters.widened`.
    """

    stage: str
    verdict: Literal["ok", "warning", "missing", "refused"]
    message: str
    moves: tuple[Direction, ...] = ()
