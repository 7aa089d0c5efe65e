"""What a scenario says about a robot and its laboratory: magnitudes, widths and instruments.

SI units. Every field is validated here once; nothing downstream checks it again. Magnitudes of one robot are values,
what differs between robots is drawn: placements from zero-mean normals, offsets and gaps within +-spread of theirs, and
any value that is given as a distribution (`twin.uncertain`).
"""

from collections.abc import Iterator
from dataclasses import field
from typing import Annotated, Literal, get_args

from pydantic import Field
from pydantic.dataclasses import dataclass
from pydantic_core import InitErrorDetails, PydanticCustomError

from twin.config_arm import FRICTION_HELD, Arm, LinkEncoders, MotorEncoders, SomeHeld, Torso
from twin.config_base import Base
from twin.config_campaign import Campaign
from twin.config_datasheet import Datasheet
from twin.config_departures import Departures
from twin.config_instruments import LogErrors, MocapErrors, PlateErrors, PlatePlace, WristSensor
from twin.config_names import OF_KEY, ArmLinkName, LinkName, of_another_body, refuse, unknown
from twin.config_session import Session
from twin.config_values import (
    BY_NAME,
    STRICT,
    NonNegative,
    Point,
    Positive,
    Rate,
    Value,
    Vector3,
    in_order,
)
from twin.uncertain import DRAWN

BodyName = Literal["base", "shoulder", "gripper"]


@dataclass(frozen=True, config=STRICT)
class Load:
    """The payload, declared to the laboratory as it stands here.

    Attributes:
        mass: [kg].
        com: In the tool frame [m].
        size: Edge lengths [m].
        com_error: Standard deviation of the true centre of mass, per axis [m].
    """

    mass: Annotated[float, Field(ge=0.0, le=3.0), DRAWN]
    com: Point
    size: tuple[Positive, Positive, Positive]
    com_error: NonNegative


@dataclass(frozen=True, config=STRICT)
class Widths:
    """What differs from one robot of the series to the next, standard deviations unless said.

    Attributes:
        placement_translation: Each joint placement, per axis [m].
        placement_rotation: Each joint placement, per axis [rad].
        link_mass: Relative [-].
        link_com: Per axis [m].
        mount_translation: Where the arm is bolted on, per axis, on top of its first joint's placement [m].
        mount_rotation: The same, per axis [rad].
        spread: Half width of the uniform factor on offsets and gaps [-]; 0 leaves them as written.
        makes: Arms of other makes, of which a robot has one: masses of its links over the datasheet's [-], 1 where
            none is given. Without any, the datasheet's.
    """

    placement_translation: NonNegative
    placement_rotation: NonNegative
    link_mass: Annotated[float, Field(ge=0.0, le=0.3), DRAWN]
    link_com: NonNegative
    spread: Annotated[float, Field(ge=0.0, le=0.9), DRAWN] = 0.0
    mount_translation: NonNegative = 0.0
    mount_rotation: NonNegative = 0.0
    makes: tuple[dict[ArmLinkName, Annotated[float, Field(ge=0.3, le=3.0), DRAWN]], ...] = ()


@dataclass(frozen=True, config=STRICT)
class MarkerBody:
    """A marker cluster: where it should be, and how far off it is mounted.

    Attributes:
        link: The link that carries it; the body's frame is nominally the link's.
        markers: Nominal position of each marker in that frame [m].
        translation: Standard deviation of the cluster's placement, per axis [m].
        rotation: [rad].
        marker: Standard deviation of each marker within its cluster, per axis [m].
    """

    link: LinkName
    markers: Annotated[dict[str, Vector3], Field(min_length=1), BY_NAME]
    translation: NonNegative
    rotation: NonNegative
    marker: NonNegative


@dataclass(frozen=True, config=STRICT)
class ClockSetting:
    """t_mocap = t (1 + drift) + offset: offset [s], drift [-]."""

    offset: Value
    drift: Annotated[float, Field(ge=-1e-3, le=1e-3), DRAWN]


@dataclass(frozen=True, config=STRICT)
class Instruments:
    """Rates [Hz], noises per sample and clocks.

    Attributes:
        bodies: Marker clusters by name.
        mocap_rate: [Hz].
        marker_noise: Per axis [m].
        plate_rate: [Hz].
        plate_force_noise: Per axis [N].
        plate_moment_noise: Per axis [N.m].
        robot_rate: [Hz].
        current_quantum: [A].
        link_encoders: Absolute encoders.
        robot_clock: The robot's.
        plate_clock: The plate's.
        motor_encoders: Eccentricity on the motor side.
        mocap: What is wrong with the motion capture.
        plate: With the plate.
        plate_grid: Into how many plates, along x and y, the plate's square is cut; no wheel may stand on a seam.
        plate_place: Where that square lies.
        log: With the robot's log.
        wrist: The force-torque sensor of the wrist; null: none.
    """

    bodies: Annotated[dict[BodyName, MarkerBody], in_order(get_args(BodyName))]
    mocap_rate: Rate
    marker_noise: Positive
    plate_rate: Annotated[float, Field(ge=10.0, le=10e3)]
    plate_force_noise: Positive
    plate_moment_noise: Positive
    robot_rate: Rate
    current_quantum: Positive
    link_encoders: LinkEncoders
    robot_clock: ClockSetting
    plate_clock: ClockSetting
    motor_encoders: MotorEncoders = field(default_factory=MotorEncoders)
    mocap: MocapErrors = field(default_factory=MocapErrors)
    plate: PlateErrors = field(default_factory=PlateErrors)
    log: LogErrors = field(default_factory=LogErrors)
    plate_grid: tuple[Annotated[int, Field(ge=1, le=4)], Annotated[int, Field(ge=1, le=4)]] = (1, 1)
    plate_place: PlatePlace = field(default_factory=PlatePlace)
    wrist: WristSensor | None = field(default_factory=WristSensor)

    def __post_init__(self) -> None:
        """Each marker of the laboratory has a name of its own."""
        owner: dict[str, str] = {}
        again = [(b, m) for b, body in self.bodies.items() for m in body.markers if owner.setdefault(m, b) != b]
        refuse(
            "Instruments",
            [
                InitErrorDetails(type=of_another_body(owner[m]), loc=("bodies", b, "markers", m, OF_KEY), input=m)
                for b, m in again
            ],
        )


@dataclass(frozen=True, config=STRICT)
class TwinConfig:
    """Everything `record` needs beside a seed.

    Attributes:
        arm: Arm joints by name, base to tip.
        torso: The lift and its column.
        base: Wheels and floor.
        payload: In the hand.
        widths: What is drawn.
        instruments: The laboratory.
        campaign: What is recorded.
        datasheet: What is declared.
        timestep: Of the simulation [s].
        gear_form: dead_zone: load torque decides the flank; friction_held: friction holds the play, the mesh slips.
        friction_held: What that form adds, by joint; joints not named keep the dead zone.
        coupled_wrist: Whether arm_6 and arm_7 are driven by one differential.
        departures: What no model of the pipeline holds.
        session: What changes until the confirmation.
    """

    arm: Arm
    torso: Torso
    base: Base
    payload: Load
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

    def __post_init__(self) -> None:
        """What one field says fits what the others say."""
        refuse("TwinConfig", [*self._loose(), *self._unheld(), *self._ungrounded()])

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
