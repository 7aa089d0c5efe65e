"""Which errors are a breakdown of the numbers, and of what: a singular matrix, an overflow, a value that is not finite.

Everything else that is not one of `calibration.errors` is a mistake of this program.
"""

import traceback
from collections.abc import Callable
from types import TracebackType

import numpy as np

from calibration.errors import NumericalFailure

_NOT_FINITE = ("infs or NaNs", "not finite", "must be finite", "non-finite", "NaN or Inf", "cannot convert float NaN")
_OURS = "calibration"


class Breakdowns:
    """A block in which a breakdown of the numbers becomes a `NumericalFailure` of the stage it is at.

    Args:
        stage: The stage it begins with.
        progress: Called with stage and share done, through this one.
    """

    def __init__(self, stage: str, progress: Callable[[str, float], None] | None = None) -> None:
        self.stage, self._progress = stage, progress

    def __call__(self, stage: str, share: float) -> None:
        """Note the stage, and pass it on."""
        self.stage = stage
        if self._progress is not None:
            self._progress(stage, share)

    def __enter__(self) -> "Breakdowns":
        """Itself, to be called at each stage."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        """Raise NumericalFailure where that is what happened."""
        found = None if error is None else failure_of(error, self.stage)
        if found is not None:
            raise found from error


def failure_of(error: BaseException, stage: str) -> NumericalFailure | None:
    """The breakdown an error is, or None where it is something else."""
    if not _is_numerical(error):
        return None
    why = " ".join(str(error).split()) or type(error).__name__
    return NumericalFailure(stage, _quantity(error), why.splitlines()[0][:200])


def _is_numerical(error: BaseException) -> bool:
    if isinstance(error, np.linalg.LinAlgError | ArithmeticError):
        return True
    findings = getattr(error, "errors", None)  # pydantic: a result that cannot be written because it is not finite
    if isinstance(error, ValueError) and callable(findings):
        return all(found["type"] == "finite_number" for found in findings())
    return isinstance(error, ValueError) and any(words in str(error) for words in _NOT_FINITE)


def _quantity(error: BaseException) -> str:
    """What the innermost function of ours computes, by the first line of its documentation, or by its name."""
    for frame, _ in reversed(list(traceback.walk_tb(error.__traceback__))):
        module = str(frame.f_globals.get("__name__", ""))
        if module.partition(".")[0] == _OURS and module != __name__:
            about = (frame.f_globals.get("__doc__") or "").strip().partition("\n")[0]
            return f"{frame.f_code.co_name} ({about.rstrip('.')})"
    return "a library"
