"""What a defect is: an edit of a robot's specification that can be read back as numbers.

A defect is its own configuration: a frozen dataclass whose fields are validated where it is made. One that a scenario
may name under `twin.defects` has a field `kind` and a line in `twin/defects/__init__.py`; see `twin.defects.bending`.
"""

from typing import Protocol, Self

import mujoco
import numpy as np

from twin.errors import UnknownElement
from twin.truth import Parameter

UNTOUCHED = (0, 2)
"""contype and conaffinity of a shape that touches nothing, and that a compiler discarding such shapes still keeps."""


class Trial(Protocol):
    """What of a motion a defect may depend on; see `twin.motions.Motion`."""

    @property
    def payload(self) -> float | None:
        """Mass in the hand [kg]; None: the campaign's."""

    @property
    def rolls(self) -> bool:
        """Whether the base moves on its wheels."""


class Defect:
    """A departure of one robot from nominal; a frozen dataclass derives from it."""

    def sample(self, rng: np.random.Generator) -> Self:
        """The defect of one robot; itself, unless it is described by what differs between robots."""
        return self

    def at(self, trial: Trial, time: float) -> "Defect":
        """The defect in a trial whose middle is `time` [s] after the campaign's start; itself, unless it changes."""
        return self

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Edit the specification, a copy."""

    def tune(self, model: mujoco.MjModel) -> None:
        """Edit what only the compiled model knows: constraint impedances scale with inverse inertias."""

    def parameters(self) -> tuple[Parameter, ...]:
        """Every number of this defect, for the truth."""
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
