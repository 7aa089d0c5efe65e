"""The instruments of a laboratory as a scenario describes them; what they get wrong is off unless named. SI units."""

from dataclasses import field
from typing import Annotated, get_args

from pydantic import Field
from pydantic.dataclasses import dataclass
from pydantic_core import InitErrorDetails

from twin.fields.names import OF_KEY, BodyName, of_another_body, refuse
from twin.fields.values import STRICT, OneOfKind, Positive, Rate, in_order
from twin.instruments import INSTRUMENTS
from twin.instruments.clock import ClockSetting
from twin.instruments.encoder import LinkEncoders, MotorEncoders
from twin.instruments.force_plate import PlateErrors
from twin.instruments.instrument import Instrument
from twin.instruments.markers import MarkerBody
from twin.instruments.motion_capture import MocapErrors
from twin.instruments.robot_log import LogErrors
from twin.instruments.wrist_sensor import WristSensor
from twin.simulation.force_plates import PlatePlace

AnyInstrument = Annotated[Instrument, OneOfKind(INSTRUMENTS)]


@dataclass(frozen=True, config=STRICT)
class Instruments:
    """Rates [Hz], noises per sample and clocks.

    Attributes:
        bodies: Marker clusters by name.
        mocap_rate: Rate of the motion capture [Hz].
        marker_noise: Standard deviation per axis and sample [m].
        plate_rate: Rate of the force plate [Hz].
        plate_force_noise: Standard deviation per axis and sample [N].
        plate_moment_noise: Standard deviation per axis and sample [N.m].
        robot_rate: Rate of the robot's log [Hz].
        current_quantum: Step of the motor currents [A].
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
        further: Instruments of any kind that `twin.instruments` knows.
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
    further: tuple[AnyInstrument, ...] = ()

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
