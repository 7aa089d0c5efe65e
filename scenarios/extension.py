"""A scenario file that says what differs from another scenario."""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field


class Extension(BaseModel):
    """A scenario that is another one but for some values.

    Attributes:
        name: Its name.
        description: One line.
        extends: Name of the other one.
        set: Values by `path.to.field`.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
    description: str
    extends: str
    set: dict[str, Any]
