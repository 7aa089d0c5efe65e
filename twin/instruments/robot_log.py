"""The robot's own log: encoders on both sides, velocity, motor current, set-points, the wrist's wrench.

Stamps jitter about the ticks of the robot's clock, messages are lost, velocity passes a first-order low-pass.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy
from pydantic.dataclasses import dataclass as validated

from twin.fields.values import STRICT, FixedNonNegative, FixedPositive, NonNegative
from twin.instruments.clock import Clock, latency
from twin.instruments.encoder import Encoder
from twin.instruments.instrument import Channels, Instrument, Streams, Timing
from twin.instruments.sampling import interpolate, windows, within
from twin.instruments.wrist_sensor import WristDefect, wrist_samples
from twin.motions.swings import JOINTS
from twin.simulation.states import States
from twin.truth import Parameter

_MOST = 0.45  # of the interval between ticks that a stamp may be off [-]


@validated(frozen=True, config=STRICT)
class LogErrors:
    """Of the robot's log.

    Attributes:
        jitter: Standard deviation of the stamps about the ticks of the robot's clock [s].
        latency: Delay from sampling to time stamp [s].
        velocity_cutoff: Cutoff of the velocity's first-order low-pass [Hz]; 0: none.
        dropouts: How often messages are lost [1/min].
        dropout_duration: Duration of each loss [s].
    """

    jitter: FixedNonNegative = 0.0
    latency: NonNegative = 0.0
    velocity_cutoff: FixedNonNegative = 0.0
    dropouts: FixedNonNegative = 0.0
    dropout_duration: FixedPositive = 0.15


@dataclass(frozen=True)
class RobotLog(Instrument):
    """The log of one robot, the wrist's sensor included.

    Attributes:
        encoders: Of its joints.
        per_ampere: Force or torque over current by joint [N/A, N.m/A].
        current_quantum: [A].
        errors: Of the log.
        clock: The robot's; stamps of a log that is late are late.
        rate: [Hz].
        wrist: The wrist's sensor, if there is one.
        mocap_latency: Of the motion capture, to whose stamps the truth refers [s].
    """

    encoders: tuple[Encoder, ...]
    per_ampere: dict[str, float]
    current_quantum: float
    errors: LogErrors
    clock: Clock
    rate: float
    wrist: WristDefect | None
    mocap_latency: float
    of_force = False

    def measure(self, states: States, timing: Timing, streams: Streams) -> Channels:
        """Samples of every joint (n, 8) and of the wrist (n, 6)."""
        clock = replace(self.clock, offset=self.clock.offset - self.errors.latency)
        stamps, true = clock.ticks(timing.start, timing.stop, self.rate)
        t, step = true - timing.start, self.current_quantum
        current = interpolate(t, states.t, states.torque) / np.array([self.per_ampere[j] for j in JOINTS])
        wrench = np.full((len(t), 6), np.nan)
        if self.wrist is not None:
            wrench = wrist_samples(t, self.rate, states.t, states.wrist, self.wrist, streams("wrist"))
        samples = {
            "q_motor": _read(interpolate(t, states.t, states.motor), self.encoders, "motor"),
            "q_link": _read(interpolate(t, states.t, states.link), self.encoders, "link"),
            "v_motor": interpolate(t, states.t, _low_passed(states, self.errors.velocity_cutoff)),
            "effort": np.round(current / step) * step,
            "q_command": interpolate(t, states.t, states.command),
            "wrist_wrench": wrench,
        }
        rng = streams("robot")
        samples["t_robot"] = stamped(stamps, self.rate, self.errors, rng)
        there = received(samples["t_robot"], self.errors, rng)
        return {"joint": JOINTS, **{name: values[there] for name, values in samples.items()}}

    def parameters(self) -> tuple[Parameter, ...]:
        """Of encoders, drives, clock, log and wrist; the clock against the motion capture's, latencies included."""
        e, late = self.errors, self.mocap_latency
        clock = replace(self.clock, offset=self.clock.offset - e.latency + late)
        gears = ((n, "force", "N/A") if n == JOINTS[0] else (n, "torque", "N.m/A") for n in JOINTS)
        log = [
            ("jitter", "s", e.jitter),
            ("velocity_cutoff", "Hz", e.velocity_cutoff),
            ("dropouts", "1/min", e.dropouts),
        ]
        log += [("dropout_duration", "s", e.dropout_duration)] if e.dropouts else []
        return (
            *(p for source in (*self.encoders, clock) for p in source.parameters()),
            *latency("robot", e.latency),
            *(Parameter(f"gear.{n}.{of}_per_ampere", unit, self.per_ampere[n]) for n, of, unit in gears),
            Parameter("log.current_quantum", "A", self.current_quantum),
            *(Parameter(f"log.{name}", unit, value) for name, unit, value in log if value),
            *(() if self.wrist is None else self.wrist.parameters()),
        )


def stamped(t: np.ndarray, rate: float, errors: LogErrors, rng: np.random.Generator) -> np.ndarray:
    """Stamps (n,) [s] that jitter about the ticks t; they never overtake each other."""
    if not errors.jitter:
        return t
    return t + np.clip(errors.jitter * rng.normal(size=len(t)), -_MOST / rate, _MOST / rate)


def received(t: np.ndarray, errors: LogErrors, rng: np.random.Generator) -> np.ndarray:
    """Whether the message of each stamp (n,) was not lost."""
    if not errors.dropouts:
        return np.ones(len(t), dtype=bool)
    return ~within(t, windows(t, errors.dropouts, errors.dropout_duration, rng))


def _low_passed(states: States, cutoff: float) -> np.ndarray:
    """Motor velocity (n, 8) through dv/dt = 2 pi cutoff (v_motor - v)."""
    if not cutoff:
        return states.motor_velocity
    sos = scipy.signal.butter(1, cutoff, fs=1.0 / (states.t[1] - states.t[0]), output="sos")
    first = scipy.signal.sosfilt_zi(sos)[:, :, None] * states.motor_velocity[0]
    return np.asarray(scipy.signal.sosfilt(sos, states.motor_velocity, axis=0, zi=first)[0])


def _read(q: np.ndarray, encoders: tuple[Encoder, ...], side: str) -> np.ndarray:
    readings = np.full_like(q, np.nan)
    for encoder in encoders:
        if encoder.side == side:
            column = JOINTS.index(encoder.joint_name)
            readings[:, column] = encoder.read(q[:, column])
    return readings
