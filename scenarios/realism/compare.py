"""Many sampled robots against the log of a real one: swings by its figures, and its wrench replayed on their bases."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, fields
from functools import partial
from typing import TypeVar

import numpy as np

from scenarios.files.scenario import Scenario
from scenarios.realism.log import Recorded
from scenarios.realism.replayed import AS_DRAWN, AXES, BAND, Condition, Inside, inside, replayed, together
from scenarios.realism.swings import LOG, Figures, YawFromMoment, figures, matrix, swung, yaw_from_moment
from scenarios.steps import Progress, silent
from twin.errors import TwinError

T = TypeVar("T")
_UNITS = {"F": ("N", 1.0), "M": ("N.m", 1.0), "x": ("mm", 1e3), "y": ("mm", 1e3), "z": ("mm", 1e3)}


@dataclass(frozen=True)
class FigureRow:
    """One figure of the log beside the draws' range; peak to peak."""

    figure: str
    unit: str
    log: tuple[float, float]
    low: float
    median: float
    high: float
    inside: bool


@dataclass(frozen=True)
class Swings:
    """Draws of one swing.

    Attributes:
        n: Robots that could be simulated.
        failed: Why others could not.
        rows: Figures.
        linear: R2 of yaw by Mz on the second half: 5 %, median, 95 %.
        hysteretic: The same with play operators.
    """

    n: int
    failed: tuple[str, ...]
    rows: tuple[FigureRow, ...]
    linear: tuple[float, float, float]
    hysteretic: tuple[float, float, float]

    @property
    def n_inside(self) -> int:
        """Figures inside."""
        return sum(row.inside for row in self.rows)


@dataclass(frozen=True)
class Replayed:
    """Draws under a recorded wrench.

    Attributes:
        condition: What is not nominal.
        n: Robots.
        trials: Share of the time inside the band, by trial.
        share: Of all of them, by axis.
    """

    condition: Condition
    n: int
    trials: tuple[Inside, ...]
    share: tuple[float, ...]


def compare_swings(scenario: Scenario, n: int, progress: Progress = silent) -> Swings:
    """Swing n sampled robots."""
    config = scenario.twin

    def one(seed: int) -> tuple[Figures, YawFromMoment] | str:
        try:
            s = swung(config, seed)
        except TwinError as error:
            return f"seed {seed}: {error}"
        return figures(s, config.campaign.rest), yaw_from_moment(s.slow(s.rotation)[:, 2], s.slow(s.wrench)[:, 5])

    found = _each(one, range(scenario.seed, scenario.seed + n), partial(progress, "reality", "swings"))
    good = [f for f in found if not isinstance(f, str)]
    rows = _rows(matrix([f for f, _ in good]))
    linear, hysteretic = (_range([getattr(y, k) for _, y in good]) for k in ("linear", "hysteretic"))
    return Swings(len(good), tuple(f for f in found if isinstance(f, str)), rows, linear, hysteretic)


def compare_replay(
    scenario: Scenario,
    trials: Sequence[Recorded],
    n: int,
    condition: Condition = AS_DRAWN,
    progress: Progress = silent,
) -> Replayed:
    """Replay the wrench of each trial on the bases of n sampled robots."""
    seeds, found = range(scenario.seed, scenario.seed + n), []
    for k, trial in enumerate(trials):
        show = partial(_part, progress, f"{trial.trial_id}, {condition.name}", k, len(trials))
        draws = _each(partial(_base, scenario, trial, condition), seeds, show)
        found.append(inside(trial, np.array(draws)))
    return Replayed(condition, n, tuple(found), tuple(map(float, together(found))))


def _base(scenario: Scenario, trial: Recorded, condition: Condition, seed: int) -> np.ndarray:
    return replayed(scenario.twin, seed, trial, condition)


def _part(progress: Progress, at: str, k: int, n: int, share: float) -> None:
    """Show how far the k-th of n parts is."""
    progress("replay", at, (k + share) / n)


def _each(one: Callable[[int], T], seeds: range, progress: Callable[[float], None]) -> list[T]:
    """Robots in threads: the simulation holds no interpreter lock."""
    found: list[T] = []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for made in pool.map(one, seeds):
            found.append(made)
            progress(len(found) / len(seeds))
    return found


def _range(values: Sequence[float]) -> tuple[float, float, float]:
    low, median, high = np.quantile(values, (BAND[0], 0.5, BAND[1]))
    return float(low), float(median), float(high)


def _rows(values: np.ndarray) -> tuple[FigureRow, ...]:
    found = []
    for field, column in zip(fields(Figures), values.T, strict=True):
        unit, factor = _UNITS.get(field.name[0] if len(field.name) < 3 else "", ("mrad", 1e3))
        low, median, high = (factor * v for v in _range(column))
        log = (factor * LOG[field.name][0], factor * LOG[field.name][1])
        found.append(FigureRow(field.name, unit, log, low, median, high, low <= log[1] and log[0] <= high))
    return tuple(found)


def as_json(swings: Sequence[Swings], replays: Sequence[Replayed]) -> dict[str, object]:
    """What is saved."""
    return {
        "schema": 1,
        "swings": [asdict(s) | {"n_inside": s.n_inside} for s in swings],
        "replays": [
            {
                **asdict(r.condition),
                "n": r.n,
                "share": dict(zip(AXES, r.share, strict=True)),
                "trials": [
                    asdict(t) | {k: np.round(getattr(t, k), 7).tolist() for k in ("share", "measured", "spread")}
                    for t in r.trials
                ],
            }
            for r in replays
        ],
    }
