"""The wrist's force-torque sensor: the wrench averaged over each sample of the log, with a zero, noise and steps.

    w_m = round(w + z + n)

Action of the hand on the sensor, in the sensor's axes, about its origin [N, N.m].
"""

from dataclasses import dataclass

import numpy as np
from pydantic.dataclasses import dataclass as validated

from twin.defects.defect import Defect
from twin.fields.values import STRICT, FixedNonNegative, NonNegative
from twin.instruments.force_plate import rounded
from twin.instruments.sampling import averaged
from twin.truth import Parameter


@validated(frozen=True, config=STRICT)
class WristSensor:
    """The force-torque sensor between wrist and hand, read with the encoders; widths are between sensors.

    Attributes:
        force_noise: Standard deviation per axis and sample [N].
        moment_noise: Standard deviation per axis and sample [N.m].
        force_resolution: Step of the force readings [N].
        moment_resolution: Step of the moment readings [N.m].
        force_offset: Standard deviation of the zero [N].
        moment_offset: Standard deviation of the zero [N.m].
    """

    force_noise: NonNegative = 0.1
    moment_noise: NonNegative = 0.003
    force_resolution: FixedNonNegative = 0.0625
    moment_resolution: FixedNonNegative = 0.002
    force_offset: NonNegative = 0.0
    moment_offset: NonNegative = 0.0


@dataclass(frozen=True)
class WristDefect(Defect):
    """One sensor.

    Attributes:
        zero: z (6,) what it reads unloaded [N, N.m].
        sigma: White noise per sample (6,) [N, N.m].
        resolution: (6,) [N, N.m]; 0: none.
    """

    zero: np.ndarray
    sigma: np.ndarray
    resolution: np.ndarray

    def parameters(self) -> tuple[Parameter, ...]:
        """Noise, and zero and steps where there are any."""
        units = ("N",) * 3 + ("N.m",) * 3
        zero = [Parameter(f"wrist.zero_{k + 1}", units[k], float(z)) for k, z in enumerate(self.zero)]
        found = zero if self.zero.any() else []
        for of, k in (("force", 0), ("moment", 3)):
            found.append(Parameter(f"wrist.{of}_noise", units[k], float(self.sigma[k])))
            if self.resolution[k]:
                found.append(Parameter(f"wrist.{of}_resolution", units[k], float(self.resolution[k])))
        return tuple(found)


def sample_wrist(sensor: WristSensor, rng: np.random.Generator) -> WristDefect:
    """One sensor of the kind described."""
    return WristDefect(
        np.repeat([sensor.force_offset, sensor.moment_offset], 3) * rng.normal(size=6),
        np.repeat([sensor.force_noise, sensor.moment_noise], 3),
        np.repeat([sensor.force_resolution, sensor.moment_resolution], 3),
    )


def wrist_samples(
    t: np.ndarray, rate: float, grid: np.ndarray, wrench: np.ndarray, defect: WristDefect, rng: np.random.Generator
) -> np.ndarray:
    """Samples (n, 6) at times t (n,) [s] of the dense wrench (m, 6) at times grid (m,) [s]; `rate` in [Hz]."""
    samples = averaged(t, grid, wrench, 1.0 / rate) + defect.zero
    return rounded(samples + defect.sigma * rng.normal(size=samples.shape), defect.resolution)
