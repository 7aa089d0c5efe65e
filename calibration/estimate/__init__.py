"""An estimate and its files.

Names are imported when they are first used, so that a table of errors is read without Pinocchio.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from calibration.estimate.estimate import Estimate, RobotNames
    from calibration.estimate.files import CALIBRATED, load_estimate, save_estimate
    from calibration.estimate.rows import SOURCES

__all__ = ["CALIBRATED", "SOURCES", "Estimate", "RobotNames", "load_estimate", "save_estimate"]

_MODULES = {"Estimate": "estimate", "RobotNames": "estimate", "SOURCES": "rows"}


def __getattr__(name: str) -> Any:
    """A public name, from the module that defines it."""
    if name in __all__:
        return getattr(import_module(f"calibration.estimate.{_MODULES.get(name, 'files')}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
