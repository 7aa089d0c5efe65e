"""The nominal TIAGo and its laboratory: readable MJCF files, and a URDF derived from them.

The XML files beside this one are the only place where a number of the nominal robot is typed; SOURCES.md says
where each comes from. Everything else here is read from the model they compile to.
"""

from mjcf.nominal import ROOT, Wheel, model, scene_path, spec, wheels
from mjcf.urdf_export import NotAUrdfTree, rpy_from_matrix, urdf

__all__ = [
    "ROOT",
    "NotAUrdfTree",
    "Wheel",
    "model",
    "rpy_from_matrix",
    "scene_path",
    "spec",
    "urdf",
    "wheels",
]
