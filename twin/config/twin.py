"""A robot and its laboratory as a scenario describes them: magnitudes, widths and instruments.

SI units. Every field is validated here once; nothing downstream checks it again. Magnitudes of one robot are values,
what differs between robots is sampled: placements from zero-mean normals, gears and wheels within +-spread of theirs,
and any value that is given as a distribution (`twin.fields.distributions`).
"""

from collections.abc import Iterator
from dataclasses import field, fields
from typing import Annotated, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass
from pydantic_core import InitErrorDetails, PydanticCustomError

from twin.config.instruments import Instruments
from twin.config.robot import FRICTION_HELD, Arm, SomeHeld, Torso, Widths
from twin.defects import DEFECTS, Defect
from twin.defects.bending import Cable, Flexibility
from twin.defects.floor_tilt import FloorTilt, Tilt
from twin.defects.inertia import Payload
from twin.defects.placement import ThermalDrift
from twin.defects.wheels.base import Base
from twin.fields.distributions import sampled
from twin.fields.names import OF_KEY, ArmLinkName, ArmName, JointName, refuse, unknown
from twin.fields.values import BY_NAME, STRICT, FixedNonNegative, FixedPositive, Keyed, NonNegative, OneOfKind
from twin.instruments.markers import LooseMarker
from twin.motions.campaign import Campaign

AnyDefect = Annotated[Defect, OneOfKind(DEFECTS)]


@dataclass(frozen=True, config=STRICT)
class Departures:
    """Disturbances that no model of the calibration contains, by the part they concern; each is off unless named.

    `twin.defects` lists any defect.

    Attributes:
        bending: By link of the arm; the column bends as `torso` says.
        warming: By joint of the torso or the arm.
        floor_tilt: Rotation of the floor, and of the lab's axes with it, out of level about x and y [rad].
        cables: By joint of the arm.
        loosened: By marker.
    """

    bending: Annotated[dict[ArmLinkName, Flexibility], Keyed("link"), BY_NAME] = field(default_factory=dict)
    warming: Annotated[dict[JointName, ThermalDrift], Keyed("joint_name"), BY_NAME] = field(default_factory=dict)
    floor_tilt: tuple[Tilt, Tilt] = (0.0, 0.0)
    cables: Annotated[dict[ArmName, Cable], Keyed("joint_name"), BY_NAME] = field(default_factory=dict)
    loosened: Annotated[dict[str, LooseMarker], Keyed("name"), BY_NAME] = field(default_factory=dict)

    def defects(self) -> Iterator[Defect]:
        """Those that change the robot or its floor."""
        yield from self.bending.values()
        yield from self.warming.values()
        if any(self.floor_tilt):
            yield FloorTilt(self.floor_tilt)
        yield from self.cables.values()


@dataclass(frozen=True, config=STRICT)
class Session:
    """What changes from the first session to the confirmation; markers are remounted with their bodies' own widths.

    Attributes:
        base_translation: Half width of the base's move, per axis [m].
        base_rotation: Half width of its turn [rad].
        encoder_zero: Standard deviation of a motor encoder's zero after homing again [rad]: three steps of the absolute
            encoder it is homed by.
    """

    base_translation: NonNegative = 0.08
    base_rotation: NonNegative = 0.5
    encoder_zero: NonNegative = 3e-4


@dataclass(frozen=True, config=STRICT)
class Datasheet:
    """Tolerances declared to the laboratory, standard deviations; see `calibration.schema.Tolerances`.

    Attributes:
        joint_translation: Joint placement, per axis [m].
        joint_rotation: Joint placement, per axis [rad].
        encoder_offset: Zero of the motor encoder [rad].
        joint_play: Backlash: motor-side reading minus joint angle, offset apart [rad].
        body_translation: Marker cluster on its link, per axis [m].
        body_rotation: Marker cluster on its link, per axis [rad].
        link_mass: Relative to the link's mass [-].
        link_com: Centre of mass, per axis [m].
        joint_delay: Median delay of a link behind its motor by viscous friction [s].
        joint_delay_spread: Standard deviation of the delay's logarithm [-].
        joint_windup: Dry friction over stiffness of a gear [rad].
        payload_mass: Mass of the payload [kg].
    """

    joint_translation: FixedPositive
    joint_rotation: FixedPositive
    encoder_offset: FixedPositive
    joint_play: FixedPositive
    body_translation: FixedPositive
    body_rotation: FixedPositive
    link_mass: FixedPositive
    link_com: FixedPositive
    joint_delay: FixedPositive
    joint_delay_spread: FixedPositive
    joint_windup: FixedPositive
    payload_mass: FixedNonNegative


@dataclass(frozen=True, config=STRICT)
class RobotConfig:
    """A robot and its laboratory; fields: `TwinConfig`."""

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
                "unused", "gear_form dead_zone has no friction_held; set gear_form to friction_held"
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
    """The values of a scenario: nominal ones and distributions, which a dataset may describe.

    Attributes:
        arm: Arm joints by name, base to tip.
        torso: The lift and its column.
        base: Wheels and floor.
        payload: In the hand.
        widths: What is sampled.
        instruments: The laboratory.
        campaign: What is recorded.
        datasheet: What is declared.
        timestep: Time step of the simulation [s].
        gear_form: What decides the flank: load torque (`dead_zone`), or friction, with a mesh that slips.
        friction_held: What that form adds, by joint; joints not named keep the dead zone.
        coupled_wrist: Whether arm_6 and arm_7 are driven by one differential.
        departures: Disturbances that no model of the calibration contains.
        session: What changes until the confirmation.
        defects: Further defects of any kind that `twin.defects` knows, applied last, in this order.
    """


@dataclass(frozen=True, config=STRICT)
class SampledConfig(RobotConfig):
    """One robot's true values: no value has a distribution."""


def sampled_config(config: TwinConfig, seed: int) -> SampledConfig:
    """The values of the robot of a seed."""
    one = sampled(config, seed)
    return SampledConfig(**{f.name: getattr(one, f.name) for f in fields(one)})
