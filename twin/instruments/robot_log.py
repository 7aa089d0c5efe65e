"""The robot's own log: encoders on both sides, velocity, motor current, set-points, the wrist's wrench.

Stamps jitter about the ticks of the robot's clock, messages are lost, velocity passes a first-order low-pass.
"""

from dataclasses import dataclass, fields

import numpy as np
from pydantic.dataclasses import dataclass as validated
from scipy.signal import butter, sosfilt, sosfilt_zi

from twin.fields.values import STRICT, FixedNonNegative, FixedPositive, NonNegative
from twin.instruments.encoder import Encoder
from twin.instruments.sampling import interpolate, windows, within
from twin.motions.swings import JOINTS
from twin.simulation.states import States

_MOST = 0.45  # of the interval between ticks that a stamp may be off [-]


@validated(frozen=True, config=STRICT)
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


@dataclass(frozen=True)
class RobotLog:
    """Samples (n, 8) of every joint and (n, 6) of the wrist; see `calibration.recording.Trial` for the fields."""

    q_motor: np.ndarray
    q_link: np.ndarray
    v_motor: np.ndarray
    effort: np.ndarray
    q_command: np.ndarray
    wrist_wrench: np.ndarray


@dataclass(frozen=True)
class Drives:
    """What the drives report beside their encoders.

    Attributes:
        per_ampere: Force or torque over current (8,) [N/A, N.m/A].
        quantum: Step of the current [A].
        velocity_cutoff: Of the velocity's low-pass [Hz]; 0: none.
    """

    per_ampere: np.ndarray
    quantum: float
    velocity_cutoff: float


def measured(
    t: np.ndarray, states: States, encoders: tuple[Encoder, ...], drives: Drives, wrench: np.ndarray | None = None
) -> RobotLog:
    """The log at true times t (n,) [s from the first set-point]; `wrench` (n, 6) is what the wrist's sensor reads."""

    def sampled(values: np.ndarray) -> np.ndarray:
        return interpolate(t, states.t, values)

    return RobotLog(
        q_motor=_read(sampled(states.motor), encoders, "motor"),
        q_link=_read(sampled(states.link), encoders, "link"),
        v_motor=sampled(_slowed(states, drives.velocity_cutoff)),
        effort=np.round(sampled(states.torque) / drives.per_ampere / drives.quantum) * drives.quantum,
        q_command=sampled(states.command),
        wrist_wrench=np.full((len(t), 6), np.nan) if wrench is None else wrench,
    )


def stamped(t: np.ndarray, rate: float, errors: LogErrors, rng: np.random.Generator) -> np.ndarray:
    """Stamps (n,) [s] that jitter about the ticks t; they never overtake each other."""
    if not errors.jitter:
        return t
    return t + np.clip(errors.jitter * rng.normal(size=len(t)), -_MOST / rate, _MOST / rate)


def kept(t: np.ndarray, log: RobotLog, errors: LogErrors, rng: np.random.Generator) -> tuple[np.ndarray, RobotLog]:
    """The messages that were not lost."""
    if not errors.dropouts:
        return t, log
    there = ~within(t, windows(t, errors.dropouts, errors.dropout_duration, rng))
    return t[there], RobotLog(**{f.name: getattr(log, f.name)[there] for f in fields(log)})


def _slowed(states: States, cutoff: float) -> np.ndarray:
    """Motor velocity (n, 8) through dv/dt = 2 pi cutoff (v_motor - v)."""
    if not cutoff:
        return states.motor_velocity
    sos = butter(1, cutoff, fs=1.0 / (states.t[1] - states.t[0]), output="sos")
    first = sosfilt_zi(sos)[:, :, None] * states.motor_velocity[0]
    return np.asarray(sosfilt(sos, states.motor_velocity, axis=0, zi=first)[0])


def _read(q: np.ndarray, encoders: tuple[Encoder, ...], side: str) -> np.ndarray:
    readings = np.full_like(q, np.nan)
    for encoder in encoders:
        if encoder.side == side:
            column = JOINTS.index(encoder.joint_name)
            readings[:, column] = encoder.read(q[:, column])
    return readings
