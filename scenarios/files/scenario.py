"""A scenario: a robot, its laboratory and a seed, as typed and validated values."""

from dataclasses import replace
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from calibration.options import Options
from twin import TwinConfig


class Scenario(BaseModel):
    """What a scenario file says.

    Attributes:
        name: Its name.
        description: One line.
        seed: Random seed; the same seed gives the same bytes.
        twin: Robot and laboratory.
        calibration: What is chosen about the calibration.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
    description: str
    seed: Annotated[int, Field(ge=0)] = 0
    twin: TwinConfig
    calibration: Annotated[Options, Field(default_factory=Options)]

    def quick(self) -> "Scenario":
        """The same robot and laboratory, a campaign of about 3 minutes: for tests; less data, larger errors."""
        whole = self.twin.campaign
        short = replace(
            whole,
            calibration_postures=min(24, whole.calibration_postures),
            validation_postures=min(6, whole.validation_postures),
            dwell=0.9,
            sweep=min(3.0, whole.sweep),
            calibration_swing=min(6.0, whole.calibration_swing),
            validation_swing=min(8.0, whole.validation_swing),
        )
        return self.model_copy(update={"twin": replace(self.twin, campaign=short)})
