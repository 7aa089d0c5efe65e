"""What the truth tells of instruments beside what is drawn for one of them: noise, steps, scales and losses."""

from collections.abc import Iterator

import numpy as np

from twin.config.instruments import Instruments
from twin.config.twin import RobotConfig
from twin.instruments.motion_capture import MocapErrors
from twin.instruments.robot_log import LogErrors
from twin.truth import Parameter


def constants(config: RobotConfig) -> tuple[Parameter, ...]:
    """Every constant of the instruments; of what is off unless a scenario names it, what is on."""
    i = config.instruments
    return (*_noise(i), *_drives(config), *_log(i.log), *_capture(i.mocap))


def _noise(i: Instruments) -> Iterator[Parameter]:
    """White, per sample and axis."""
    yield Parameter("mocap.noise", "m", i.marker_noise)
    yield Parameter("plate.force_noise", "N", i.plate_force_noise)
    yield Parameter("plate.moment_noise", "N.m", i.plate_moment_noise)


def _drives(config: RobotConfig) -> Iterator[Parameter]:
    """From torque to current, and the current's step."""
    yield Parameter("gear.torso_lift_joint.force_per_ampere", "N/A", config.torso.force_per_ampere)
    for name, joint in config.arm.items():
        yield Parameter(f"gear.{name}.torque_per_ampere", "N.m/A", joint.torque_per_ampere)
    yield Parameter("log.current_quantum", "A", config.instruments.current_quantum)


def _log(log: LogErrors) -> Iterator[Parameter]:
    if log.jitter:
        yield Parameter("log.jitter", "s", log.jitter)
    if log.velocity_cutoff:
        yield Parameter("log.velocity_cutoff", "Hz", log.velocity_cutoff)
    if log.dropouts:
        yield Parameter("log.dropouts", "1/min", log.dropouts)
        yield Parameter("log.dropout_duration", "s", log.dropout_duration)


def _capture(mocap: MocapErrors) -> Iterator[Parameter]:
    """Its scale and field are the drawn volume's."""
    if mocap.bias:
        yield Parameter("mocap.bias_length", "m", mocap.bias_length)
    if mocap.swaps:
        yield Parameter("mocap.swaps", "1/min", mocap.swaps)
        yield Parameter("mocap.swap_duration", "s", mocap.swap_duration)
    if mocap.cameras:
        yield Parameter("mocap.arm_radius", "m", mocap.arm_radius)
    for k, camera in enumerate(np.array(mocap.cameras), 1):
        yield from (Parameter(f"mocap.camera_{k}.{a}", "m", float(v)) for a, v in zip("xyz", camera, strict=True))
