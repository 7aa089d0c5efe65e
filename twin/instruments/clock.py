"""Clocks: each instrument reads its own, and stamps what it measures with a latency.

    shown by instrument i at true time t + latency_i:  (t + latency_i - offset_i) / (1 + drift_i)

The campaign's clock is the motion capture's: its stamps are true times of exposure plus its latency. So

    t_mocap = t_i (1 + drift_i) + offset_i + latency_mocap - latency_i
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass as validated

from twin.fields.distributions import DRAWN
from twin.fields.values import STRICT, Value
from twin.truth import Parameter


@validated(frozen=True, config=STRICT)
class ClockSetting:
    """t_mocap = t (1 + drift) + offset.

    Attributes:
        offset: Offset of the clock [s].
        drift: Drift of the clock [-].
    """

    offset: Value
    drift: Annotated[float, Field(ge=-1e-3, le=1e-3), DRAWN]


@dataclass(frozen=True)
class Clock:
    """The clock of one instrument.

    Attributes:
        instrument: Its name.
        offset: [s].
        drift: [-].
    """

    instrument: str
    offset: float = 0.0
    drift: float = 0.0

    def reading(self, true: np.ndarray) -> np.ndarray:
        """What the clock shows at true times (n,) [s]."""
        return (np.asarray(true) - self.offset) / (1.0 + self.drift)

    def ticks(self, start: float, stop: float, rate: float) -> tuple[np.ndarray, np.ndarray]:
        """Regular samples of this clock within true times start..stop: readings (n,) and true times (n,) [s]."""
        first, last = np.ceil(self.reading(np.array([start, stop])) * rate - [1e-9, 0.0])
        shown = np.arange(int(first), int(last)) / rate
        return shown, shown * (1.0 + self.drift) + self.offset

    def parameters(self) -> tuple[Parameter, ...]:
        """Offset and drift."""
        name = f"clock.{self.instrument}"
        return Parameter(f"{name}.offset", "s", self.offset), Parameter(f"{name}.drift", "-", self.drift)


def latency(instrument: str, value: float) -> tuple[Parameter, ...]:
    """From the instant an instrument measures to its stamp [s], if there is one."""
    return (Parameter(f"latency.{instrument}", "s", value),) if value else ()
