"""What a scenario records: trials, their motions and durations, and those in which the base moves; SI units."""

from dataclasses import field
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, StringConstraints
from pydantic.dataclasses import dataclass

from twin.fields.names import one_of, other_than
from twin.fields.values import (
    STRICT,
    Count,
    FixedNonNegative,
    FixedPositive,
    GivenApproaches,
    GivenPosture,
)
from twin.motions.swings import CALIBRATION_SWINGS, FURTHER_SWINGS, VALIDATION_SWINGS

JOLTED = "postures_jolts"
TRIALS = (
    *("postures", "sweeps", *CALIBRATION_SWINGS, *VALIDATION_SWINGS, *FURTHER_SWINGS),
    *("push", "postures_validation", JOLTED),
)
TrialName = Annotated[str, one_of("trial", lambda: TRIALS)]
OwnName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_-]+$"), other_than("trial", lambda: TRIALS)]
Form = Literal["kinematic", "wheels"]
Payloads = tuple[Annotated[float, Field(ge=0.0, le=3.0)], ...]
Rests = Annotated[int, Field(ge=4, le=100)]


@dataclass(frozen=True, config=STRICT)
class Trajectory:
    """A motion of one's own.

    Attributes:
        file: CSV file, see `twin.motions.csv_trajectory`; from the current folder.
        role: calibration: the fit may use it; validation: it is predicted.
    """

    file: str
    role: Literal["calibration", "validation"] = "validation"


OwnMotion = Annotated[Trajectory, BeforeValidator(lambda value: {"file": value} if isinstance(value, str) else value)]
"""Or its file alone."""


@dataclass(frozen=True, config=STRICT)
class Driving:
    """Trials in which the base moves, a spin and a drive for each form.

    Attributes:
        forms: kinematic: the base is carried along its path, no physics; wheels: by its own wheels, on the floor.
        spin_rests: Rests of a spin, evenly over one turn.
        drive_rests: Rests of a drive.
        stride: Distance from rest to rest of a drive [m].
        yaw_rate: Yaw rate of a spin [rad/s].
        speed: Speed of a drive [m/s].
        ramp: Duration of the velocity ramps [s]: one period of the base on its wheels, which leaves it still.
    """

    forms: tuple[Form, ...] = ()
    spin_rests: Rests = 12
    drive_rests: Rests = 9
    stride: Annotated[float, Field(gt=0.0, le=0.5)] = 0.1
    yaw_rate: Annotated[float, Field(gt=0.0, le=2.0)] = 0.4
    speed: Annotated[float, Field(gt=0.0, le=1.0)] = 0.1
    ramp: FixedPositive = 0.6


@dataclass(frozen=True, config=STRICT)
class Campaign:
    """How much is recorded.

    Attributes:
        ramp: Duration of the velocity ramp that starts and stops a motion [s].
        posture_ramp: The same for moves between postures [s]; None: `ramp`.
        rest: Rest at the start and end of each trial [s].
        speed: Largest joint speed between postures [rad/s].
        dwell: Rest in each static posture [s].
        calibration_postures: Number of static postures for the calibration.
        validation_postures: Number of static postures kept aside.
        given_postures: Calibration postures [m, rad] as `tiago-twin design` chooses them, the lift first, instead of
            `calibration_postures` sampled ones.
        given_approaches: For each of these postures the sign of each joint's last motion before it rests, by way of a
            point 0.05 rad (the lift 5 mm) before it; 0: it does not matter. Empty: straight from the last.
        sweep: Duration of each one-joint sweep [s]; 0: no sweeps.
        calibration_swing: Duration of each calibration swing [s]; 0: none.
        validation_swing: Duration of each validation swing [s]; 0: none.
        pause: Pause between trials, on every clock [s].
        payloads: Further masses [kg] with which the first validation swing is repeated.
        calibration_payloads: Further masses [kg] with which calibration swings `around_z` and `around_y` are repeated.
        push: Force [N] with which the hand is pushed in a validation trial; 0: no such trial.
        confirmation: Whether a second session follows, with markers remounted, base moved and encoders homed again.
        driving: Trials in which the base moves.
        carried: Whether every trial is without physics, joints and base where they are commanded to be.
        motions: Motions of one's own by the names of their trials.
        only: Trials to record beside these, `sweeps` for those of one joint; empty: all but `FURTHER_SWINGS` and
            `postures_jolts`, the validation postures with moves as abrupt as those of swings. A confirmation repeats
            those of validation.
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
    payloads: Payloads = ()
    calibration_payloads: Payloads = ()
    push: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    confirmation: bool = False
    driving: Driving = field(default_factory=Driving)
    posture_ramp: Annotated[float, Field(gt=0.0, le=3.0)] | None = None
    carried: bool = False
    only: tuple[TrialName, ...] = ()
    given_postures: tuple[GivenPosture, ...] = ()
    given_approaches: GivenApproaches = ()
    motions: dict[OwnName, OwnMotion] = field(default_factory=dict)
