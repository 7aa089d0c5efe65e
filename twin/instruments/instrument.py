"""What an instrument is: sensors in the model, readings of a simulated trial, and numbers in the truth.

An instrument of one's own is its own configuration, as a defect is: a frozen dataclass with a field `kind`, a line in
`twin/instruments/__init__.py`, and a row in the layout of `calibration.recording` for each channel it returns.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import mujoco
import numpy as np

from twin.simulation.states import States
from twin.truth import Parameter

Channels = dict[str, Any]
"""Arrays and labels by their names in a recording."""
Streams = Callable[[str], np.random.Generator]
"""Random streams of one trial, by name."""


@dataclass(frozen=True)
class Timing:
    """True times of a trial.

    Attributes:
        start: Of its first set-point [s].
        stop: Of its last one [s].
        epoch: Of the campaign's start [s].
    """

    start: float
    stop: float
    epoch: float


class Instrument:
    """An instrument of one laboratory; a frozen dataclass derives from it."""

    of_force = True
    """Whether it measures what kinematic playback has not: forces and accelerations."""

    def sample(self, rng: np.random.Generator) -> Self:
        """The instrument of one laboratory; itself, unless it is described by what differs between them."""
        return self

    def sense(self, spec: mujoco.MjSpec) -> None:
        """Add its sensors to a specification; those named `instrument.x` are found as x in `States.sensors`."""

    def measure(self, states: States, timing: Timing, streams: Streams) -> Channels:
        """Its readings of a trial."""
        raise NotImplementedError

    def parameters(self) -> tuple[Parameter, ...]:
        """Every number of this instrument, for the truth."""
        return ()
