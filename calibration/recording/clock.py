"""An instrument's clock on that of the motion capture: t_mocap = t (1 + drift) + offset."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Clock:
    """A clock: t_mocap = t (1 + drift) + offset.

    Attributes:
        instrument: `robot` or `plate`.
        offset: At t = 0 [s].
        drift: [-].
        covariance: (2, 2) of (offset, drift) [s, -].
        epoch: Time on the instrument's clock [s] at which offset and drift are uncorrelated.
        sigma: Standard deviation of t_mocap at `epoch` [s].
    """

    instrument: str
    offset: float
    drift: float
    covariance: np.ndarray
    epoch: float
    sigma: float

    def to_mocap(self, t: np.ndarray) -> np.ndarray:
        """Times t [s] of the instrument on the motion-capture clock [s]."""
        return t + (self.offset + self.drift * t)

    def from_mocap(self, t: np.ndarray) -> np.ndarray:
        """Times t [s] of the motion-capture clock on the instrument's clock [s]."""
        return (t - self.offset) / (1.0 + self.drift)

    def sigma_at(self, t: np.ndarray) -> np.ndarray:
        """Standard deviations (n,) of t_mocap [s] at times t (n,) of the instrument [s]."""
        offset, both, drift = self.covariance[0, 0], self.covariance[0, 1], self.covariance[1, 1]
        return np.sqrt(np.maximum(offset + (2.0 * both + drift * t) * t, 0.0))


def shared_clock(instrument: str) -> Clock:
    """The clock of an instrument that one machine samples together with the motion capture."""
    return Clock(instrument, 0.0, 0.0, np.zeros((2, 2)), 0.0, 0.0)
