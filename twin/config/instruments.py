"""What a scenario may say is wrong with the instruments, beside noise and clocks; all of it is off unless named. SI."""

from dataclasses import field
from typing import Annotated, get_args

from pydantic import Field
from pydantic.dataclasses import dataclass
from pydantic_core import InitErrorDetails

from twin.config.distributions import DRAWN
from twin.config.names import OF_KEY, BodyName, LinkName, of_another_body, refuse
from twin.config.robot import LinkEncoders, MotorEncoders
from twin.config.values import (
    BY_NAME,
    STRICT,
    FixedNonNegative,
    FixedPositive,
    NonNegative,
    Positive,
    Rate,
    Value,
    Vector3,
    in_order,
)

Small = Annotated[float, Field(ge=-0.05, le=0.05), DRAWN]


@dataclass(frozen=True, config=STRICT)
class MocapErrors:
    """Of the motion capture.

    Attributes:
        scale: Relative error of all lengths [-].
        bias: Standard deviation of a smooth field of position errors, per axis [m].
        bias_length: Over which that field changes [m].
        latency: From exposure to time stamp [s].
        cameras: Where they are [m]; a marker that fewer than two see past the arm is lost. None: all is seen.
        arm_radius: Of what hides markers [m].
        swaps: Times per minute that two markers of a body exchange labels [1/min].
        swap_duration: Of each [s].
    """

    scale: Small = 0.0
    bias: NonNegative = 0.0
    bias_length: FixedPositive = 1.5
    latency: NonNegative = 0.0
    cameras: tuple[Vector3, ...] = ()
    arm_radius: FixedPositive = 0.06
    swaps: FixedNonNegative = 0.0
    swap_duration: FixedPositive = 0.3


@dataclass(frozen=True, config=STRICT)
class PlateErrors:
    """Of the force plate, in its own axes; widths are standard deviations of what is drawn for one plate.

    Attributes:
        gain: Of each diagonal entry of the gain matrix about 1 [-].
        crosstalk: Of each other entry, relative; a length of 1 m relates forces and moments [-].
        force_drift: Of the offset's rate [N/s].
        moment_drift: Of the offset's rate [N.m/s].
        force_resolution: Step [N].
        moment_resolution: Step [N.m].
        cutoff: Of the anti-alias filter, Butterworth of order 2 [Hz]; 0: none.
    """

    gain: NonNegative = 0.0
    crosstalk: NonNegative = 0.0
    force_drift: NonNegative = 0.0
    moment_drift: NonNegative = 0.0
    force_resolution: FixedNonNegative = 0.0
    moment_resolution: FixedNonNegative = 0.0
    cutoff: FixedNonNegative = 0.0


@dataclass(frozen=True, config=STRICT)
class PlatePlace:
    """Where the plate lies against its nominal place, as surveyed: it is declared.

    Attributes:
        shift: Of its centre along the lab's x and y [m].
        height: Of its surface above the floor around it [m]; the robot stands on it.
        yaw: About the vertical [rad].
    """

    shift: tuple[Annotated[float, Field(ge=-0.5, le=0.5)], Annotated[float, Field(ge=-0.5, le=0.5)]] = (0.0, 0.0)
    height: Annotated[float, Field(ge=-0.05, le=0.05)] = 0.0
    yaw: Annotated[float, Field(ge=-3.2, le=3.2)] = 0.0


@dataclass(frozen=True, config=STRICT)
class WristSensor:
    """The force-torque sensor between wrist and hand, read with the encoders; widths are of what is drawn for one.

    Attributes:
        force_noise: Per axis and sample [N].
        moment_noise: Per axis and sample [N.m].
        force_resolution: Step [N].
        moment_resolution: Step [N.m].
        force_offset: Standard deviation of the zero [N].
        moment_offset: Standard deviation of the zero [N.m].
    """

    force_noise: NonNegative = 0.1
    moment_noise: NonNegative = 0.003
    force_resolution: FixedNonNegative = 0.0625
    moment_resolution: FixedNonNegative = 0.002
    force_offset: NonNegative = 0.0
    moment_offset: NonNegative = 0.0


@dataclass(frozen=True, config=STRICT)
class LogErrors:
    """Of the robot's log.

    Attributes:
        jitter: Standard deviation of the stamps about the ticks of the robot's clock [s].
        latency: From sampling to time stamp [s].
        velocity_cutoff: Of the velocity's first-order low-pass [Hz]; 0: none.
        dropouts: Times per minute that messages are lost [1/min].
        dropout_duration: Of each [s].
    """

    jitter: FixedNonNegative = 0.0
    latency: NonNegative = 0.0
    velocity_cutoff: FixedNonNegative = 0.0
    dropouts: FixedNonNegative = 0.0
    dropout_duration: FixedPositive = 0.15


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
