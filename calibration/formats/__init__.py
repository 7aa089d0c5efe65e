"""Laboratory formats: C3D, CSV and ROS bags, both ways.

Names are imported when they are first used, so that a mapping is read without Pinocchio and the readers.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from calibration.formats.exporter import export_trials
    from calibration.formats.importer import import_files, refuse_foreign
    from calibration.formats.later import of_later_session
    from calibration.formats.mapping.mapping import Mapping, MappingFile
    from calibration.formats.mapping.short_form import written_out
    from calibration.formats.readers import reader_of
    from calibration.formats.survey.draft import draft
    from calibration.formats.survey.session import Drawing, session_of

__all__ = [
    "Drawing",
    "Mapping",
    "MappingFile",
    "draft",
    "export_trials",
    "import_files",
    "of_later_session",
    "reader_of",
    "refuse_foreign",
    "session_of",
    "written_out",
]

_MODULES = {
    "exporter": ("export_trials",),
    "importer": ("import_files", "refuse_foreign"),
    "later": ("of_later_session",),
    "mapping.mapping": ("Mapping", "MappingFile"),
    "mapping.short_form": ("written_out",),
    "readers": ("reader_of",),
    "survey.draft": ("draft",),
    "survey.session": ("Drawing", "session_of"),
}


def __getattr__(name: str) -> Any:
    """A public name, from the module that defines it."""
    for module, names in _MODULES.items():
        if name in names:
            return getattr(import_module(f"calibration.formats.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
