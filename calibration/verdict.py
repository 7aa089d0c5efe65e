"""A finding of a stage, kept with the estimate."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Verdict:
    """What a stage has to say.

    Attributes:
        stage: Name of the stage.
        verdict: `ok`; `warning`, usable with care; `missing`, data for it were not there; `refused`, must not be used.
        message: What was found and what to do.
    """

    stage: str
    verdict: Literal["ok", "warning", "missing", "refused"]
    message: str
