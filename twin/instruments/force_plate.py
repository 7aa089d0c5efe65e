"""Force plate: the wrench averaged over each sample, with white noise and what one plate gets wrong.

    w_m = R round(F[G R' w] + r (t - t0) + n)

Action of the robot on the plate, lab axes, about the plate's surface centre [N, N.m]; R turns both of its halves from
the plate's axes, in which it samples, to the lab's. F is the anti-alias filter, G
the gain matrix with crosstalk, r the drift of the offset since the campaign's start t0. F delays by
sqrt(2) / (2 pi cutoff) at low frequency, which no time stamp knows.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import scipy
from pydantic.dataclasses import dataclass as validated

from twin.defects.defect import Defect
from twin.fields.values import STRICT, FixedNonNegative, NonNegative
from twin.instruments.clock import Clock, latency
from twin.instruments.instrument import Channels, Instrument, Streams, Timing
from twin.instruments.sampling import averaged
from twin.simulation.states import States
from twin.truth import Parameter


@validated(frozen=True, config=STRICT)
class PlateErrors:
    """Of the force plate, in its own axes; widths are standard deviations between plates.

    Attributes:
        gain: Standard deviation of each diagonal entry of the gain matrix, mean 1 [-].
        crosstalk: Standard deviation of each other entry [-]; a length of 1 m relates forces and moments.
        force_drift: Standard deviation of the drift rate of forces [N/s].
        moment_drift: Standard deviation of the drift rate of moments [N.m/s].
        force_resolution: Step of the force readings [N]; 0: none.
        moment_resolution: Step of the moment readings [N.m]; 0: none.
        cutoff: Cutoff of the anti-alias filter, Butterworth of order 2 [Hz]; 0: none.
    """

    gain: NonNegative = 0.0
    crosstalk: NonNegative = 0.0
    force_drift: NonNegative = 0.0
    moment_drift: NonNegative = 0.0
    force_resolution: FixedNonNegative = 0.0
    moment_resolution: FixedNonNegative = 0.0
    cutoff: FixedNonNegative = 0.0


@dataclass(frozen=True)
class PlateDefect(Defect):
    """One plate, in its own axes.

    Attributes:
        name: Its name.
        gain: G (6, 6) [-, m, 1/m].
        drift: r (6,) [N/s, N.m/s].
        resolution: (6,) [N, N.m]; 0: none.
        cutoff: Of the filter [Hz]; 0: none.
    """

    name: str
    gain: np.ndarray
    drift: np.ndarray
    resolution: np.ndarray
    cutoff: float

    @property
    def delay(self) -> float:
        """Of the filter at low frequency [s]."""
        return float(np.sqrt(2.0) / (2.0 * np.pi * self.cutoff)) if self.cutoff else 0.0

    def parameters(self) -> tuple[Parameter, ...]:
        """Gains, drift, steps and filter, where they are not ideal."""
        found, name = [], f"plate.{self.name}"
        if (self.gain != np.eye(6)).any():
            units = [["-", "1/m"], ["m", "-"]]
            found += [
                Parameter(f"{name}.gain_{i + 1}{j + 1}", units[i // 3][j // 3], float(self.gain[i, j]))
                for i in range(6)
                for j in range(6)
            ]
        if self.drift.any():
            units_of = ("N/s",) * 3 + ("N.m/s",) * 3
            found += [Parameter(f"{name}.drift_{i + 1}", units_of[i], float(r)) for i, r in enumerate(self.drift)]
        steps = (("force", "N", self.resolution[0]), ("moment", "N.m", self.resolution[3]))
        found += [Parameter(f"{name}.{of}_resolution", unit, float(step)) for of, unit, step in steps if step]
        if self.cutoff:
            found.append(Parameter(f"{name}.cutoff", "Hz", self.cutoff))
        return tuple(found)


def sample_plate(name: str, errors: PlateErrors, rng: np.random.Generator) -> PlateDefect:
    """One plate of the kind `errors` describes."""
    width = np.where(np.eye(6) == 1.0, errors.gain, errors.crosstalk)
    return PlateDefect(
        name,
        np.eye(6) + width * rng.normal(size=(6, 6)),
        np.repeat([errors.force_drift, errors.moment_drift], 3) * rng.normal(size=6),
        np.repeat([errors.force_resolution, errors.moment_resolution], 3),
        errors.cutoff,
    )


@dataclass(frozen=True)
class Sampling:
    """Samples of a plate.

    Attributes:
        t: True times (n,) [s].
        since: The campaign's start [s].
        rate: [Hz].
        sigma: White noise per sample (6,) [N, N.m].
        R_lab_plate: The plate's axes as columns (3, 3).
    """

    t: np.ndarray
    since: float
    rate: float
    sigma: np.ndarray
    R_lab_plate: np.ndarray = field(default_factory=lambda: np.eye(3))


def measured(
    at: Sampling, grid: np.ndarray, wrench: np.ndarray, defect: PlateDefect, rng: np.random.Generator
) -> np.ndarray:
    """Samples (n, 6) of the dense wrench (m, 6) at times grid (m,) [s]."""
    seen = _turned(wrench, at.R_lab_plate.T)
    seen = seen if (defect.gain == np.eye(6)).all() else seen @ defect.gain.T
    if defect.cutoff:
        sos = scipy.signal.butter(2, defect.cutoff, fs=1.0 / (grid[1] - grid[0]), output="sos")
        seen = scipy.signal.sosfilt(sos, seen, axis=0, zi=scipy.signal.sosfilt_zi(sos)[:, :, None] * seen[0])[0]
    samples = averaged(at.t, grid, seen, 1.0 / at.rate)
    samples = samples + at.sigma * rng.normal(size=samples.shape)
    if defect.drift.any():
        samples += defect.drift * (at.t - at.since)[:, None]
    return _turned(rounded(samples, defect.resolution), at.R_lab_plate)


def _turned(wrench: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Force and moment of wrenches (n, 6) turned by R (3, 3)."""
    return (wrench.reshape(-1, 2, 3) @ R.T).reshape(-1, 6)


def rounded(samples: np.ndarray, resolution: np.ndarray) -> np.ndarray:
    """Samples (n, 6) in whole steps (6,); 0: as they are."""
    step = np.where(resolution > 0.0, resolution, 1.0)
    return np.where(resolution > 0.0, np.round(samples / step) * step, samples)


@dataclass(frozen=True)
class ForcePlates(Instrument):
    """The plates of one laboratory, on one clock.

    Attributes:
        plates: Each with its errors.
        sigma: White noise per sample (6,) [N, N.m].
        clock: The plates'.
        rate: [Hz].
        mocap_latency: Of the motion capture, to whose stamps the truth refers [s].
    """

    plates: tuple[PlateDefect, ...]
    sigma: np.ndarray
    clock: Clock
    rate: float
    mocap_latency: float

    def measure(self, states: States, timing: Timing, streams: Streams) -> Channels:
        """Wrenches (n, n_plates, 6), one plate after the other in the stream of their noise."""
        stamps, true = self.clock.ticks(timing.start, timing.stop, self.rate)
        at = Sampling(true, timing.epoch, self.rate, self.sigma, states.T_lab_plates[0, :3, :3])
        rng, t = streams("plate"), states.t + timing.start
        each = zip(np.moveaxis(states.plates, 1, 0), self.plates, strict=True)
        wrench = np.stack([measured(at, t, dense, plate, rng) for dense, plate in each], axis=1)
        names, centres = tuple(p.name for p in self.plates), states.T_lab_plates[:, :3, 3]
        return {"plate": names, "t_plate": stamps, "plate_wrench": wrench, "plate_centre": centres}

    def parameters(self) -> tuple[Parameter, ...]:
        """Of clock, filter, noise and each plate; the clock against the motion capture's, latencies included."""
        delay = self.plates[0].delay
        clock = replace(self.clock, offset=self.clock.offset + self.mocap_latency - delay)
        return (
            *clock.parameters(),
            *latency("plate", delay),
            *(p for plate in self.plates for p in plate.parameters()),
            Parameter("plate.force_noise", "N", float(self.sigma[0])),
            Parameter("plate.moment_noise", "N.m", float(self.sigma[3])),
        )
