"""A robot and its laboratory as a scenario describes them: magnitudes, widths and instruments.

SI units. Every field is validated here once; nothing downstream checks it again. Magnitudes of one robot are values,
what differs between robots is sampled: placements from zero-mean normals, offsets and gaps within +-spread of theirs,
and any value that is given as a distribution (`twin.fields.distributions`).
"""

from collections.abc import Iterator
from dataclasses import field, fields
from typing import Annotated, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass
from pydantic_core import InitErrorDetails, PydanticCustomError

from twin.config.datasheet import Datasheet
from twin.config.disturbances import Departures
from twin.config.instruments import Instruments
from twin.config.robot import FRICTION_HELD, Arm, SomeHeld, Torso, Widths
from twin.config.session import Session
from twin.defects import DEFECTS, Defect
from twin.defects.inertia import Payload
from twin.defects.wheels.base import Base
from twin.fields.distributions import sampled
from twin.fields.names import OF_KEY, refuse, unknown
from twin.fields.values import STRICT, OneOfKind
from twin.motions.campaign import Campaign

AnyDefect = Annotated[Defect, OneOfKind(DEFECTS)]


@dataclass(frozen=True, config=STRICT)
class RobotConfig:
    """A robot and its laboratory.

    Attributes:
        arm: Arm joints by name, base to tip.
        torso: The lift and its column.
        base: Wheels and floor.
        payload: In the hand.
        widths: What is sampled.
        instruments: The laboratory.
        campaign: What is recorded.
        datasheet: What is declared.
        timestep: Of the simulation [s].
        gear_form: dead_zone: load torque decides the flank; friction_held: friction does, and the mesh slips.
        friction_held: What that form adds, by joint; joints not named keep the dead zone.
        coupled_wrist: Whether arm_6 and arm_7 are driven by one differential.
        departures: Disturbances that no model of the calibration contains.
        session: What changes until the confirmation.
        defects: Further defects of any kind that `twin.defects` knows, applied last, in this order.
    """

    arm: Arm
    torso: Torso
    base: Base
    payload: Payload
    widths: Widths
    instruments: Instruments
    campaign: Campaign
    datasheet: Datasheet
    timestep: Annotated[float, Field(ge=1e-5, le=0.002)] = field(default=0.001)
    gear_form: Literal["dead_zone", "friction_held"] = "dead_zone"
    friction_held: SomeHeld = field(default_factory=lambda: dict(FRICTION_HELD))
    coupled_wrist: bool = False
    departures: Departures = field(default_factory=Departures)
    session: Session = field(default_factory=Session)
    defects: tuple[AnyDefect, ...] = ()

    def __post_init__(self) -> None:
        """Check fields against one another."""
        refuse("RobotConfig", [*self._loose(), *self._unheld(), *self._ungrounded()])

    def _loose(self) -> Iterator[InitErrorDetails]:
        """Markers that hang but are not there."""
        known = [m for body in self.instruments.bodies.values() for m in body.markers]
        for name in self.departures.loosened:
            if name not in known:
                yield InitErrorDetails(
                    type=unknown("marker", known), loc=("departures", "loosened", name, OF_KEY), input=name
                )

    def _unheld(self) -> Iterator[InitErrorDetails]:
        """Friction that would hold nothing."""
        if self.gear_form == "dead_zone" and self.friction_held != FRICTION_HELD:
            error = PydanticCustomError(
                "unused", "nothing is held where gear_form is dead_zone; set it to friction_held"
            )
            yield InitErrorDetails(type=error, loc=("friction_held",), input=self.friction_held)

    def _ungrounded(self) -> Iterator[InitErrorDetails]:
        """Only wheels on bushings and contacts can roll; only contacts press on one plate or another."""
        grid, forms, wheels = self.instruments.plate_grid, self.campaign.driving.forms, self.base.wheels
        if wheels == "anchored" and grid != (1, 1):
            error = PydanticCustomError("wheels", "anchored wheels press on the floor as a whole; use contact or rigid")
            yield InitErrorDetails(type=error, loc=("instruments", "plate_grid"), input=grid)
        if "wheels" in forms and wheels != "contact":
            error = PydanticCustomError(
                "wheels", "wheels cannot roll where base.wheels is '{wheels}'", {"wheels": wheels}
            )
            yield InitErrorDetails(type=error, loc=("campaign", "driving", "forms"), input=forms)


@dataclass(frozen=True, config=STRICT)
class TwinConfig(RobotConfig):
    """The values of a scenario: nominal ones and distributions, which a dataset may describe."""


@dataclass(frozen=True, config=STRICT)
class SampledConfig(RobotConfig):
    """One robot's true values: no value has a distribution."""


def sampled_config(config: TwinConfig, seed: int) -> SampledConfig:
    """The values of the robot of a seed."""
    one = sampled(config, seed)
    return SampledConfig(**{f.name: getattr(one, f.name) for f in fields(one)})
