"""Runs of the default scenario on many robots, and the figures of their score.json."""

import json
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenarios import load, run

SAMPLED = ("twin.widths.spread=0.5",)
"""Gap, offset, stiffness and friction of every gear, stiffness and friction of each type of wheel are sampled."""
SEEDS = range(1000, 1010)
_SPANS = (2000, 2020), (3000, 3020), (4000, 4170), (4222, 4240), (4246, 4403), (4404, 4409), (4410, 4433)
_SPANS += (4434, 4443), (4447, 4459), (4460, 4474), (4482, 4743)
MORE = tuple(seed for first, end in _SPANS for seed in range(first, end))
"""Robots that no method was developed on; those between were, after they were judged."""
MANY = 50
"""Robots of one kind among which those that break an open line are; of fewer none may be one."""


@dataclass(frozen=True)
class Key:
    """A row of the ladder: what predicts, where the base's motion is from, which encoder, which trials."""

    model: str
    base: str = "plate"
    encoder: str = "motor"
    trials: str = "dynamic"


@dataclass(frozen=True)
class Series:
    """The scores of several robots.

    Attributes:
        seeds: Of the robots.
        scores: Content of each score.json.
    """

    seeds: tuple[int, ...]
    scores: tuple[dict, ...]

    def figures(self, key: Key, name: str = "position_rmse_component_mm") -> np.ndarray:
        """One figure of a row, by robot."""
        return np.array([_row(score, key)[name] for score in self.scores])

    def coverage(self) -> np.ndarray:
        """Share of the 95 % intervals of all models that contain the truth, by robot."""
        return np.array([score["every_model"]["coverage_95"] for score in self.scores])

    def nees(self, model: str) -> np.ndarray:
        """Normalised estimation error squared of a model per degree of freedom, by robot."""
        return np.array([s["models"][model]["nees"] / s["models"][model]["dof"] for s in self.scores])

    def base_r2(self, axis: str, source: str = "plate") -> np.ndarray:
        """R2 of the base's predicted motion about an axis over the validation swings, by robot."""
        return np.array(
            [next(b for b in score["base"] if b["source"] == source)[f"{axis}_r2"] for score in self.scores]
        )


def _row(score: dict, key: Key) -> dict:
    found = [
        row
        for row in score["rows"]
        if (row["model"], row["base"], row["encoder"], row["trials"]) == (key.model, key.base, key.encoder, key.trials)
    ]
    assert found, f"score.json has no row {key}"
    return found[0]


def kept_series(name: str, make: Callable[[str], Path], overrides: tuple[str, ...], scenario: str) -> Series:
    """The runs of SEEDS and MORE in the folder `name` of that which the environment variable CLAIM_RUNS names.

    Where there are none, SEEDS are run, in a folder that `make` makes where the variable is not set.
    """
    kept = os.environ.get("CLAIM_RUNS")
    folder = Path(kept) / name if kept else make(name)
    there = [seed for seed in (*SEEDS, *MORE) if (folder / f"{scenario}_{seed}" / "score.json").is_file()]
    return series(folder, there or SEEDS, overrides, scenario)


def series(
    folder: Path,
    seeds: Iterable[int],
    overrides: tuple[str, ...] = (),
    scenario: str = "humanoids2024",
    quick: bool = False,
) -> Series:
    """Run a scenario on each seed; what was run before in that folder is read."""
    seeds = tuple(seeds)
    return Series(seeds, tuple(_scores(folder, seeds, overrides, scenario, quick)))


def _scores(
    folder: Path, seeds: tuple[int, ...], overrides: tuple[str, ...], scenario: str, quick: bool
) -> Iterator[dict]:
    for seed in seeds:
        out = folder / f"{scenario}_{seed}"
        if not (out / "score.json").is_file():
            run(load(scenario, (f"seed={seed}", *overrides)), out=out, quick=quick)
        yield json.loads((out / "score.json").read_text(encoding="utf-8"))
