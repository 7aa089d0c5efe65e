"""The nominal TIAGo and its laboratory: readable MJCF files, and a URDF derived from them.

The XML files beside this one are the only place where a number of the nominal robot is typed; SOURCES.md says
where each comes from. Everything else here is read from the model they compile to.
"""

from mjcf.nominal import ROOT, model, scene_path, spec
from mjcf.rpy import matrix_from_rpy, rpy_from_matrix
from mjcf.urdf_export import NotAUrdfTree, urdf
from mjcf.wheels import Wheel, wheels

__all__ = [
    "ROOT",
    "NotAUrdfTree",
    "Wheel",
    "matrix_from_rpy",
    "model",
    "rpy_from_matrix",
    "scene_path",
    "spec",
    "urdf",
    "wheels",
]
