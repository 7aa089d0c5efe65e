"""What a defect is: an edit of a robot's specification that can be read back as numbers."""

from typing import NamedTuple

import mujoco

from twin.errors import UnknownElement

UNTOUCHED = (0, 2)
"""contype and conaffinity of a shape that touches nothing, and that a compiler discarding such shapes still keeps."""


class Parameter(NamedTuple):
    """One true number.

    Attributes:
        name: Name of the contract, `geometry.arm_1_joint.x` and the like.
        unit: SI unit, `-` where there is none.
        value: The value.
    """

    name: str
    unit: str
    value: float


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
