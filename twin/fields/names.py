"""Types of the names a scenario uses: joints, links and markers that the robot and its laboratory have.

An unknown name is refused at its line, with the known ones.
"""

from collections.abc import Callable, Collection, Sequence
from typing import Annotated, Literal

from pydantic import AfterValidator, ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

import mjcf

UNKNOWN_NAME = "unknown_name"
"""Type of the finding; its context holds the `kind` of name and the names that are `known`."""
OF_KEY = "[key]"
"""What pydantic puts behind the key of a mapping when the key itself is wrong."""
TORSO = "torso_lift_joint"
ARM = tuple(f"arm_{i}_joint" for i in range(1, 8))
HAND = "gripper_grasping_frame"
BASE = mjcf.ROOT
BodyName = Literal["base", "shoulder", "gripper"]


def unknown(kind: str, known: Collection[str]) -> PydanticCustomError:
    """The finding that a name is not one of those known."""
    context = {"kind": kind, "known": ", ".join(known)}
    return PydanticCustomError(UNKNOWN_NAME, "no {kind} of this name (known here: {known})", context)


def one_of(kind: str, known: Callable[[], Collection[str]]) -> AfterValidator:
    """Refuse names that are not known."""

    def checked(name: str) -> str:
        if name not in known():
            raise unknown(kind, known())
        return name

    return AfterValidator(checked)


def other_than(kind: str, known: Callable[[], Collection[str]]) -> AfterValidator:
    """Refuse names that are taken."""

    def checked(name: str) -> str:
        if name in known():
            raise ValueError(f"there is a {kind} of this name; choose another")
        return name

    return AfterValidator(checked)


ArmName = Annotated[str, one_of("arm joint", lambda: ARM)]
JointName = Annotated[str, one_of("joint of torso or arm", lambda: (TORSO, *ARM))]
ArmLinkName = Annotated[str, one_of("link of the arm", lambda: [n.replace("_joint", "_link") for n in ARM])]


def links() -> tuple[str, ...]:
    """Links of the robot."""
    model = mjcf.model()
    root = model.body(mjcf.ROOT).id
    return tuple(model.body(i).name for i in range(model.nbody) if model.body_rootid[i] == root)


LinkName = Annotated[str, one_of("link", links)]


def of_another_body(body: str) -> PydanticCustomError:
    """The finding that two bodies have a marker of one name."""
    return PydanticCustomError("marker_name", "body {body} has a marker of this name, too", {"body": body})


def refuse(what: str, findings: Sequence[InitErrorDetails]) -> None:
    """Raise what a validator found that concerns several fields, each at its place within what is validated.

    Raises:
        ValidationError: There are findings.
    """
    if findings:
        raise ValidationError.from_exception_data(what, list(findings))
