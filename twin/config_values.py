"""Types of the values a scenario gives: SI numbers with limits.

What describes the robot or its instruments may be uncertain (`twin.uncertain`); what a person decides or declares, the
campaign and the datasheet, is `Fixed`.
"""

from typing import Annotated

from pydantic import ConfigDict, Field

from twin.uncertain import DRAWN

STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
FixedPositive = Annotated[float, Field(gt=0.0)]
FixedNonNegative = Annotated[float, Field(ge=0.0)]
Value = Annotated[float, DRAWN]
Positive = Annotated[float, Field(gt=0.0), DRAWN]
NonNegative = Annotated[float, Field(ge=0.0), DRAWN]
Angle = Annotated[float, Field(ge=-0.5, le=0.5), DRAWN]
Count = Annotated[int, Field(ge=1)]
Vector3 = tuple[float, float, float]
Point = tuple[Value, Value, Value]
Twist = tuple[Value, Value, Value, Value, Value, Value]
