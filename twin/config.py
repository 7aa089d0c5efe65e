"""What a scenario says about a robot and its laboratory: magnitudes, widths, motions and instruments.

SI units. Every field is validated here once; nothing downstream checks it again. Magnitudes of one robot are values,
what differs between robots is drawn: placements from zero-mean normals, offsets and gaps within +-spread of theirs, and
any value that is given as a distribution (`twin.uncertain`).
"""

from dataclasses import field
from typing import Annotated, Literal, get_args

from pydantic import Field
from pydantic.dataclasses import dataclass

from twin.config_arm import FRICTION_HELD, Arm, LinkEncoders, MotorEncoders, SomeHeld, Torso
from twin.config_base import Base
from twin.config_datasheet import Datasheet
from twin.config_departures import Departures
from twin.config_driving import Driving
from twin.config_instruments import LogErrors, MocapErrors, PlateErrors, PlatePlace, WristSensor
from twin.config_session import Session
from twin.config_values import (
    BY_NAME,
    STRICT,
    Count,
    FixedNonNegative,
    FixedPositive,
    GivenApproaches,
    GivenPosture,
    NonNegative,
    Positive,
    Value,
    Vector3,
    in_order,
)
from twin.uncertain import DRAWN

ArmLink = Literal[
    "arm_1_link", "arm_2_link", "arm_3_link", "arm_4_link", "arm_5_link", "arm_6_link", "arm_7_link"
]  # fmt: skip
BodyName = Literal["base", "shoulder", "gripper"]
TrialName = Literal[
    "postures", "sweeps", "around_x", "around_y", "around_z", "x_fold", "y_fold",
    "xyz", "xyz_mirror", "push", "postures_validation",
]  # fmt: skip


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
    com: Vector3
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
    makes: tuple[dict[ArmLink, Annotated[float, Field(ge=0.3, le=3.0), DRAWN]], ...] = ()


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

    link: str
    markers: Annotated[dict[str, Vector3], BY_NAME]
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
    mocap_rate: FixedPositive
    marker_noise: Positive
    plate_rate: FixedPositive
    plate_force_noise: Positive
    plate_moment_noise: Positive
    robot_rate: FixedPositive
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


@dataclass(frozen=True, config=STRICT)
class Campaign:
    """How much is recorded.

    Attributes:
        ramp: Duration of the velocity ramp that starts and stops a motion [s].
        rest: Rest at the start and end of each trial [s].
        speed: Of moves between postures [rad/s].
        dwell: Rest in each static posture [s].
        calibration_postures: Number of.
        validation_postures: Number of.
        given_postures: Calibration postures [m, rad] as `tiago-twin design` chooses them, the lift first, instead of
            `calibration_postures` drawn ones.
        given_approaches: For each of them the sign of each joint's last motion before it rests, by way of a point
            0.05 rad (the lift 5 mm) before it; 0: it does not matter. Empty: straight from the last.
        sweep: Duration of each one-joint sweep [s]; 0: no sweeps.
        calibration_swing: Duration of each calibration swing [s]; 0: none.
        validation_swing: Duration of each validation swing [s]; 0: none.
        pause: Between trials, on every clock [s].
        payloads: Further masses [kg] with which the first validation swing is repeated.
        push: Force [N] with which the hand is pushed in a validation trial; 0: no such trial.
        confirmation: Whether a second session follows, with markers remounted, base moved and encoders homed anew.
        driving: Trials in which the base moves.
        carried: Whether every trial is without physics, joints and base where they are told to be.
        only: Trials to record, `sweeps` for those of one joint; empty: all.
    """

    ramp: Annotated[float, Field(gt=0.0, le=3.0)]
    rest: Annotated[float, Field(ge=1.0, le=10.0)]
    speed: Annotated[float, Field(gt=0.0, le=1.76)]
    dwell: Annotated[float, Field(ge=0.8, le=10.0)]
    calibration_postures: Count
    validation_postures: Count
    sweep: FixedNonNegative
    calibration_swing: FixedNonNegative
    validation_swing: FixedNonNegative
    pause: FixedNonNegative
    payloads: tuple[Annotated[float, Field(ge=0.0, le=3.0)], ...] = ()
    push: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    confirmation: bool = False
    driving: Driving = field(default_factory=Driving)
    carried: bool = False
    only: tuple[TrialName, ...] = ()
    given_postures: tuple[GivenPosture, ...] = ()
    given_approaches: GivenApproaches = ()


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
    timestep: Annotated[float, Field(gt=0.0, le=0.002)] = field(default=0.001)
    gear_form: Literal["dead_zone", "friction_held"] = "dead_zone"
    friction_held: SomeHeld = field(default_factory=lambda: dict(FRICTION_HELD))
    coupled_wrist: bool = False
    departures: Departures = field(default_factory=Departures)
    session: Session = field(default_factory=Session)

    def __post_init__(self) -> None:
        """Only wheels on bushings and contacts can roll; only contacts press on one plate or another."""
        if self.base.wheels == "anchored" and self.instruments.plate_grid != (1, 1):
            raise ValueError(
                "instruments.plate_grid: anchored wheels press on the floor as a whole; use contact or rigid"
            )
        if "wheels" in self.campaign.driving.forms and self.base.wheels != "contact":
            raise ValueError(f"campaign.driving.forms: wheels cannot roll where base.wheels is {self.base.wheels!r}")
