"""What declarations are made of: strict and frozen, of bounded numbers, plain names and unique ones."""

from collections import Counter
from collections.abc import Sequence
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Number = Annotated[float, Field(ge=-1e9, le=1e9)]
Vector3 = tuple[Number, Number, Number]
Vector6 = tuple[Number, Number, Number, Number, Number, Number]
Positive = Annotated[float, Field(ge=1e-12, le=1e9)]
Positive6 = tuple[Positive, Positive, Positive, Positive, Positive, Positive]
NonNegative = Annotated[float, Field(ge=0.0, le=1e9)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}$")]
"""Plain: letters, digits, `_`, `-`, `.`; it becomes the name of files."""
Text = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]{0,200}$")]
"""One line for people."""


class Declaration(BaseModel):
    """Strict and frozen: an unknown field or a NaN is an error, not a default."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def refuse_repeated(**groups: Sequence[str]) -> None:
    """Raise ValueError for the first group that holds a name more than once."""
    for group, names in groups.items():
        twice = sorted(n for n, count in Counter(names).items() if count > 1)
        if twice:
            raise ValueError(f"{group} named more than once: {twice}")
