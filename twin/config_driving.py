"""What a scenario says about trials in which the base moves: yaw spins in steps, straight drives; SI units."""

from typing import Annotated, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from twin.config_values import STRICT, FixedPositive

Form = Literal["kinematic", "wheels"]
Rests = Annotated[int, Field(ge=4, le=100)]


@dataclass(frozen=True, config=STRICT)
class Driving:
    """Trials in which the base moves, a spin and a drive for each form.

    Attributes:
        forms: kinematic: the base is carried along its path, no physics; wheels: by its own wheels, on the floor.
        spin_rests: Rests of a spin, evenly over one turn.
        drive_rests: Rests of a drive.
        stride: From rest to rest of a drive [m].
        yaw_rate: Of a spin [rad/s].
        speed: Of a drive [m/s].
        ramp: Duration of the velocity ramps [s]: one period of the base on its wheels, which leaves it still.
    """

    forms: tuple[Form, ...] = ()
    spin_rests: Rests = 12
    drive_rests: Rests = 9
    stride: Annotated[float, Field(gt=0.0, le=0.5)] = 0.1
    yaw_rate: Annotated[float, Field(gt=0.0, le=2.0)] = 0.4
    speed: Annotated[float, Field(gt=0.0, le=1.0)] = 0.1
    ramp: FixedPositive = 0.6
