"""What can go wrong in a calibration, each error with what was found and what to do."""

from collections.abc import Sequence
from pathlib import Path


class CalibrationError(Exception):
    """Root of every error of this package: the result must not be used."""


class InputError(CalibrationError):
    """A file that cannot be used as it is.

    Attributes:
        path: The file or folder concerned.
    """

    def __init__(self, path: Path | str, message: str) -> None:
        self.path = Path(path)
        super().__init__(f"{path}: {message}")


class InputErrors(InputError):
    """Several files that cannot be used, each finding on a line of its own.

    Attributes:
        errors: The findings.
    """

    def __init__(self, errors: Sequence[InputError]) -> None:
        self.errors = tuple(errors)
        super().__init__(errors[0].path, "")
        self.args = ("\n".join(str(error) for error in errors),)


class ShapeError(CalibrationError):
    """An array whose shape is not the one its definition says."""

    def __init__(self, name: str, found: tuple[int, ...], expected: Sequence[int | str]) -> None:
        super().__init__(f"{name} has shape {found}, expected ({', '.join(str(e) for e in expected)})")


class NoSuchElement(CalibrationError):
    """A name that is not among the known ones."""

    def __init__(self, kind: str, name: str, known: Sequence[str]) -> None:
        self.name = name
        super().__init__(f"no {kind} named {name!r}; there are {sorted(known)}")


class NotEnoughData(CalibrationError):
    """Recordings that cannot answer the question asked, with what would."""


class NotCalibrated(CalibrationError):
    """An estimate whose status forbids its use.

    Attributes:
        reasons: What its verdicts say.
    """

    def __init__(self, reasons: Sequence[str]) -> None:
        self.reasons = tuple(reasons)
        super().__init__(f"the estimate is not calibrated and must not be used: {'; '.join(reasons) or 'no model'}")


class NumericalFailure(CalibrationError):
    """A computation that broke down: its stage, the quantity, and what the numbers did."""

    def __init__(self, stage: str, quantity: str, why: str) -> None:
        self.stage, self.quantity = stage, quantity
        super().__init__(
            f"{stage}: numerical failure, {why}, in: {quantity}; the recordings or the sigmas, tolerances and inertias "
            "in dataset.json are out of all proportion (look at them with `tiago-twin look`)"
        )
