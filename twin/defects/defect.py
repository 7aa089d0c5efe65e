"""What a defect is: an edit of a robot's specification that can be read back as numbers."""

import mujoco

from twin.errors import UnknownElement
from twin.truth import Parameter

UNTOUCHED = (0, 2)
"""contype and conaffinity of a shape that touches nothing, and that a compiler discarding such shapes still keeps."""


class Defect:
    """A departure of one robot from nominal; a frozen dataclass derives from it.

    `apply` edits the specification `build` copied; `tune` sets what only the compiled model knows (constraint
    impedances scale with inverse inertias); `parameters` are the truth.
    """

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Edit the specification."""

    def tune(self, model: mujoco.MjModel) -> None:
        """Edit the compiled model."""

    def parameters(self) -> tuple[Parameter, ...]:
        """Every number of this defect."""
        return ()


def body(spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
    """The body of that name.

    Raises:
        UnknownElement: There is none.
    """
    found = spec.body(name)
    if found is None:
        raise UnknownElement("body", name, (b.name for b in spec.bodies))
    return found


def joint(spec: mujoco.MjSpec, name: str) -> mujoco.MjsJoint:
    """The joint of that name.

    Raises:
        UnknownElement: There is none.
    """
    found = spec.joint(name)
    if found is None:
        raise UnknownElement("joint", name, (j.name for j in spec.joints))
    return found
