"""A recorded wrench replayed on the bases of many sampled robots: does what was measured lie among what they do?

inside_k = share of the time that  q05_k(t) <= x_k(t) <= q95_k(t)          axis k, quantiles over the draws
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scenarios.realism.log import Recorded
from twin.base_tests import WrenchHistory, massless_base_on, replay
from twin.config import TwinConfig
from twin.defects import Base, Defect, ground, wheels_of
from twin.fields import sampled
from twin.instruments import sample_plate
from twin.random_streams import generator

_HOLDS = 10.0  # times the sampled friction: no wheel slides
AXES = ("x", "y", "z", "roll", "pitch", "yaw")
BAND = (0.05, 0.95)


@dataclass(frozen=True)
class Condition:
    """What is not nominal.

    Attributes:
        shifting: Markers shift by as much as the recording's are seen to (`Recorded.shifting`).
        turning: Casters turn (`turning`), each wheel is sampled on its own, the floor holds.
    """

    shifting: bool = False
    turning: bool = False

    @property
    def name(self) -> str:
        """In words."""
        causes = ["markers shift"] * self.shifting + ["casters turn"] * self.turning
        return ", ".join(causes) or "as sampled"


AS_DRAWN = Condition()
CAUSES = (Condition(shifting=True), Condition(shifting=True, turning=True))
"""What differences from the one public log are put down to, one after the other."""


@dataclass(frozen=True)
class Inside:
    """How much of the time a measurement lies in the draws' band.

    Attributes:
        trial_id: The trial.
        n: Samples.
        share: (6,) of the time [-].
        measured: (6,) peak to peak [m, rad].
        spread: (3, 6) peak to peak of the draws: 5 %, median, 95 % [m, rad].
    """

    trial_id: str
    n: int
    share: np.ndarray
    measured: np.ndarray
    spread: np.ndarray


def inside(trial: Recorded, draws: np.ndarray) -> Inside:
    """Compare a trial with draws (k, n, 6) of its displacement."""
    low, high = np.quantile(draws, BAND, axis=0)
    share = ((trial.x >= low) & (trial.x <= high)).mean(axis=0)
    spread = np.quantile(np.ptp(draws, axis=1), (BAND[0], 0.5, BAND[1]), axis=0)
    return Inside(trial.trial_id, len(trial.t), share, np.ptp(trial.x, axis=0), spread)


def together(found: Sequence[Inside]) -> np.ndarray:
    """Share of the time (6,) over all trials."""
    return np.average([f.share for f in found], axis=0, weights=[f.n for f in found])


def gripping(base: Base, factor: float) -> Base:
    """The same base on a floor with `factor` times the friction."""
    kinds = {k: getattr(base, k) for k in ("drive", "caster_front", "caster_back")}
    return replace(base, **{k: replace(w, friction=factor * w.friction) for k, w in kinds.items()})


def turning(base: Base, weight: float) -> Base:
    """The same base on a floor that holds, its casters turning at the friction of a sixth of the weight [N]."""
    gripped = gripping(base, _HOLDS)
    kinds = {k: getattr(base, k).friction * weight / 6.0 for k in ("caster_front", "caster_back")}
    return replace(gripped, **{k: replace(getattr(gripped, k), turning_force=f) for k, f in kinds.items()})


def floor_of(config: TwinConfig, seed: int, condition: Condition, weight: float) -> tuple[Defect, ...]:
    """The wheels of one sampled robot under a condition, each sampled on its own where they turn."""
    if not condition.turning:
        base = sampled(config, seed).base
        return ground(base, wheels_of(base))
    apart = (turning(sampled(config.base, seed, "wheel", str(k)), weight) for k in range(6))
    return tuple(wheels_of(base)[k] for k, base in enumerate(apart))


def replayed(config: TwinConfig, seed: int, trial: Recorded, condition: Condition = AS_DRAWN) -> np.ndarray:
    """What one sampled robot's base does under a trial's wrench, as motion capture would see it (n, 6) [m, rad].

    The plate's errors are sampled too: what it read is not the wrench on it.

    Raises:
        Diverged: The simulation left the numbers.
    """
    robot = sampled(config, seed)
    plate = sample_plate("plate", robot.instruments.plate, generator(seed, "plate"))
    wrench = (trial.w - plate.drift * trial.t[:, None]) @ np.linalg.inv(plate.gain).T
    floor = floor_of(config, seed, condition, -float(trial.rest[2]))
    x = replay(massless_base_on(floor, robot.timestep), WrenchHistory(trial.t, trial.rest + wrench))
    shift = trial.shifting(generator(seed, "shift", trial.trial_id)) if condition.shifting else 0.0
    return trial.seen(x, robot.instruments.marker_noise, generator(seed, "seen", trial.trial_id), shift)
