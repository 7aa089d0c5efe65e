"""What a scenario may add that no model of the pipeline holds; every departure is off unless it is named. SI units."""

from dataclasses import field
from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from twin.config.distributions import DRAWN
from twin.config.names import ArmLinkName, ArmName, JointName
from twin.config.values import BY_NAME, STRICT, NonNegative, Positive, Twist, Value

Tilt = Annotated[float, Field(ge=-0.05, le=0.05), DRAWN]


@dataclass(frozen=True, config=STRICT)
class Bending:
    """A link that bends about its x and y axes: stiffness [N.m/rad], damping [N.m.s/rad]."""

    stiffness: Annotated[float, Field(ge=1e3), DRAWN]
    damping: NonNegative


@dataclass(frozen=True, config=STRICT)
class Warming:
    """A joint placement that drifts by the twist xi [m, rad] once warm, with a time constant [s]."""

    xi: Twist
    time_constant: Positive


@dataclass(frozen=True, config=STRICT)
class Cable:
    """A harness that pulls a joint towards an angle: stiffness [N.m/rad], rest [rad]."""

    stiffness: NonNegative
    rest: Value


@dataclass(frozen=True, config=STRICT)
class Loosened:
    """A marker that hangs down by `sag` [m] from `since` [s] after the campaign's start, until it is mounted anew."""

    sag: NonNegative
    since: NonNegative = 0.0


@dataclass(frozen=True, config=STRICT)
class Departures:
    """Departures no model of the pipeline holds.

    Attributes:
        bending: By link of the arm; the column bends as `torso` says.
        warming: By joint of the torso or the arm.
        floor_tilt: Rotation of the floor, and of the lab's axes with it, out of level about x and y [rad].
        cables: By joint of the arm.
        loosened: By marker.
    """

    bending: Annotated[dict[ArmLinkName, Bending], BY_NAME] = field(default_factory=dict)
    warming: Annotated[dict[JointName, Warming], BY_NAME] = field(default_factory=dict)
    floor_tilt: tuple[Tilt, Tilt] = (0.0, 0.0)
    cables: Annotated[dict[ArmName, Cable], BY_NAME] = field(default_factory=dict)
    loosened: Annotated[dict[str, Loosened], BY_NAME] = field(default_factory=dict)
