"""What a laboratory would run: recordings and a nominal URDF in, an estimate with its uncertainty out.

Names are imported when they are first used, so that `calibration.recording` alone does not load Pinocchio.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from calibration.errors import CalibrationError
    from calibration.estimate.estimate import Estimate
    from calibration.estimate.files import load_estimate, save_estimate
    from calibration.evaluation.evaluate import evaluate
    from calibration.evaluation.results import Evaluation
    from calibration.pipeline import calibrate
    from calibration.prediction.compensator import Compensator
    from calibration.prediction.predict import predictions
    from calibration.prediction.recordings import load
    from calibration.recording.dataset import Dataset
    from calibration.stages.geometry.from_arrays import fit_geometry

__all__ = [
    "CalibrationError",
    "Compensator",
    "Dataset",
    "Estimate",
    "Evaluation",
    "calibrate",
    "evaluate",
    "fit_geometry",
    "load",
    "load_estimate",
    "predictions",
    "save_estimate",
]

_MODULES = {
    "errors": ("CalibrationError",),
    "estimate.estimate": ("Estimate",),
    "estimate.files": ("load_estimate", "save_estimate"),
    "evaluation.evaluate": ("evaluate",),
    "evaluation.results": ("Evaluation",),
    "pipeline": ("calibrate",),
    "prediction.compensator": ("Compensator",),
    "prediction.predict": ("predictions",),
    "prediction.recordings": ("load",),
    "recording.dataset": ("Dataset",),
    "stages.geometry.from_arrays": ("fit_geometry",),
}


def __getattr__(name: str) -> Any:
    """A public name, from the module that defines it."""
    for module, names in _MODULES.items():
        if name in names:
            return getattr(import_module(f"calibration.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
